// The long form of the campaign of bouncing contacts against the monitor of the emergency input.
// usage: node tests/chip/bounce.mjs [PRESSES]     (default: 100000)
// exit: 1 a press was missed, or a short opening has stopped the board
import { campaign, MONITOR } from './test/monitor.mjs';

const presses = Number(process.argv[2] ?? 100_000);
const wrong = campaign(MONITOR, presses);
console.log(`${presses} presses: ${Object.keys(wrong).length} kinds of errors`);
for (const [text, seed] of Object.entries(wrong)) console.log(`${text}: first with seed ${seed}`);
process.exitCode = Object.keys(wrong).length ? 1 : 0;
