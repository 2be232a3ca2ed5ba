// TIMER alarms.
//
// Defect of rp2040js 1.4.1: the time to an alarm is computed from truncated microseconds, so that
// the alarm is up to one microsecond before the counter has the value; a driver that then reads the
// counter arms it again and again. On the chip the alarm is when the counter's lower 32 bits become
// the alarm's value (datasheet 4.6.3).
import { CYCLES_PER_US } from '../clock.mjs';

const TIMER = 0x40054;
const ALARM0 = 0x10;
const ALARM3 = 0x1c;

export function repairTimer(mcu, clock) {
  const timer = mcu.peripherals[TIMER];
  const write = timer.writeUint32.bind(timer);
  timer.writeUint32 = (offset, value) => {
    write(offset, value);
    if (offset < ALARM0 || offset > ALARM3) return;
    const counter = Math.floor(clock.now / CYCLES_PER_US);
    const ahead = (value - counter) >>> 0;
    timer.alarms[(offset - ALARM0) >> 2].clockAlarm.scheduleAt((counter + ahead) * CYCLES_PER_US);
  };
}
