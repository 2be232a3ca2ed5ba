// PWM: alarms only where an output changes.
//
// Defect of rp2040js 1.4.1: each slice that counts has three alarms in every period, also where
// its outputs stay low. The firmware's six slices then have half a million alarms a second, and the
// processor is interrupted at each.

/** Has the slices of `mcu` sleep while their outputs stay low and nothing waits for their wrap. */
export function repairPwm(mcu) {
  const { pwm } = mcu;
  const arm = (slice) => {
    slice.alarmA.enable = slice.alarmA.target > 0;
    slice.alarmB.enable = slice.alarmB.target > 0;
    const isHigh = slice.alarmA.enable || slice.alarmB.enable;
    const isWaiting = slice.ccUpdated || slice.topUpdated || pwm.intEnable !== 0;
    slice.alarmBottom.enable = isHigh || isWaiting;
  };
  for (const slice of pwm.channels) {
    const wrap = slice.wrap.bind(slice);
    slice.wrap = () => {
      wrap();
      arm(slice);
    };
  }
  const write = pwm.writeUint32.bind(pwm);
  pwm.writeUint32 = (offset, value) => {
    write(offset, value);
    pwm.channels.forEach(arm);
  };
}
