within AHRS.Filters;
block Mahony "Sampled explicit complementary filter on the rotation group"
  extends Interfaces.Estimator(q(start = {1, 0, 0, 0}, each fixed = true), rate(each start = 0, each fixed = true), gyro_bias(each start = 0, each fixed = true));
  parameter Types.Time sample_time = 0.01 "Sampling interval";
  parameter Types.Frequency kp = 1 "Proportional gain";
  parameter Types.SquaredFrequency ki = 0.1 "Integral gain";
protected
  discrete Real predicted[4](start = {1, 0, 0, 0}, each fixed = true) "Attitude carried forward by the gyroscope";
  discrete Real error[3](each start = 0, each fixed = true) "Rotation from the predicted to the measured attitude, body axes";
  Boolean started(start = false, fixed = true) "The attitude has been initialised";
equation
  when sample(sample_time, sample_time) then
    started = pre(started) or imu.accel_valid;
    predicted = if pre(started) then Functions.multiply(pre(q), Functions.fromRotationVector(sample_time*(imu.gyro - pre(gyro_bias))))
      else if imu.accel_valid and imu.mag_valid then Functions.accelMagAttitude(imu.accel, imu.mag)
      else pre(q);
    error = if pre(started) then Functions.attitudeError(predicted, imu.accel, imu.mag, imu.accel_valid, imu.mag_valid) else zeros(3);
    gyro_bias = pre(gyro_bias) - sample_time*ki*error;
    q = if pre(started) then Functions.normalise(Functions.multiply(pre(q), Functions.fromRotationVector(sample_time*(imu.gyro - gyro_bias + kp*error))))
      else predicted;
    rate = imu.gyro - gyro_bias;
  end when;
  annotation(
    Icon(graphics = {Line(points = {{40, -85}, {40, -78}, {55, -78}, {55, -85}, {70, -85}, {70, -78}, {85, -78}}, color = {80, 80, 80})}),
    Documentation(info = "<html>
<pre>
e  = e_gravity(q^-) + e_heading(q^-)        at the predicted attitude q^-
b := b - KI T e
q := q * exp((gyro - b + KP e) T)
</pre>
<p>Unlike <a href=\"modelica://AHRS.Filters.GCF\">GCF</a> rate and correction share one rotation.</p>
</html>"));
end Mahony;
