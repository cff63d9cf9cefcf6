within AHRS.Filters;
block Mahony "Sampled explicit complementary filter on the rotation group"
  extends SampledFilter;
  parameter Types.Time sample_time = Parameters.Mahony.sample_time "Sampling interval";
  parameter Types.Frequency kp = Parameters.Mahony.kp "Proportional gain";
  parameter Types.SquaredFrequency ki = Parameters.Mahony.ki "Integral gain";
  parameter Types.AngularVelocity bias_limit = Parameters.Mahony.bias_limit "Largest bias that is learned, per axis";
equation
  when sample(sample_time, sample_time) then
    started = pre(started) or imu.accel_valid;
    aligned = pre(aligned) or started and imu.mag_valid;
    before = if pre(started) and aligned and not pre(aligned) then Functions.alignHeading(pre(q), imu.mag) else pre(q);
    predicted = if pre(started) then Functions.multiply(before, Functions.fromRotationVector(sample_time*(imu.gyro - pre(gyro_bias))))
      else if imu.accel_valid then Functions.accelMagAttitude(imu.accel, if imu.mag_valid then imu.mag else zeros(3))
      else pre(q);
    error = if pre(started) then Functions.attitudeError(predicted, imu.accel, imu.mag, imu.accel_valid, imu.mag_valid) else zeros(3);
    gyro_bias = Functions.limit(pre(gyro_bias) - sample_time*ki*error, fill(bias_limit, 3));
    q = if pre(started) then Functions.continued(Functions.normalise(Functions.multiply(before,
        Functions.fromRotationVector(sample_time*(imu.gyro - gyro_bias + kp*error)))), pre(q))
      else predicted;
    rate = imu.gyro - gyro_bias;
  end when;
  annotation(
    Icon(graphics = {Text(extent = {{50, -20}, {90, -60}}, textColor = {80, 80, 80}, textString = "M")}),
    Documentation(info = "<html>
<pre>
e  = e_gravity(q^-) + e_heading(q^-)        at the predicted attitude q^-
b := limit(b - KI T e)
q := q * exp((gyro - b + KP e) T)
</pre>
<p>Unlike <a href=\"modelica://AHRS.Filters.GCF\">GCF</a> rate and correction share one rotation. The same filter as the FMU <code>mahony</code> with its default options.</p>
</html>"));
end Mahony;
