// The monitor of the emergency input in the PIO engine alone. `make bounce` presses more often.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { ARMED_TOO_EARLY, campaign, MONITOR, WITHOUT_FILTER } from './monitor.mjs';

test('no press of a bouncing contact is missed, and no short opening stops', () => {
  assert.deepEqual(campaign(MONITOR, 500), {});
});

test('the campaign finds a monitor that is armed before its flag is cleared', () => {
  assert.ok('a press is missed' in campaign(ARMED_TOO_EARLY, 200));
});

test('the campaign finds a monitor without a filter', () => {
  assert.ok('a short opening stops' in campaign(WITHOUT_FILTER, 20));
});
