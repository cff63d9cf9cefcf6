within AHRS.Filters;
block GCF "Sampled complementary filter, quaternion form, decoupled error"
  extends SampledFilter;
  parameter Types.Time sample_time = Parameters.GCF.sample_time "Sampling interval";
  parameter Types.Frequency kp = Parameters.GCF.kp "Proportional gain";
  parameter Types.SquaredFrequency ki = Parameters.GCF.ki "Integral gain; zero gives the first order";
  parameter Types.CubedFrequency kii = Parameters.GCF.kii "Gain of the double integral; zero gives the second order";
  parameter Types.AngularVelocity bias_limit = Parameters.GCF.bias_limit "Largest bias that is learned, per axis";
protected
  discrete Real bias_rate[3](each start = 0, each fixed = true) "Second integral";
equation
  when sample(sample_time, sample_time) then
    started = pre(started) or imu.accel_valid;
    aligned = pre(aligned) or started and imu.mag_valid;
    before = if pre(started) and aligned and not pre(aligned) then Functions.alignHeading(pre(q), imu.mag) else pre(q);
    predicted = if pre(started) then Functions.multiply(before, Functions.fromRotationVector(sample_time*(imu.gyro - pre(gyro_bias))))
      else if imu.accel_valid then Functions.accelMagAttitude(imu.accel, if imu.mag_valid then imu.mag else zeros(3))
      else pre(q);
    error = if pre(started) then Functions.attitudeError(predicted, imu.accel, imu.mag, imu.accel_valid, imu.mag_valid) else zeros(3);
    bias_rate = pre(bias_rate) + sample_time*kii*error;
    gyro_bias = Functions.limit(pre(gyro_bias) - sample_time*(ki*error + bias_rate), fill(bias_limit, 3));
    q = Functions.continued(Functions.normalise(Functions.multiply(predicted, Functions.fromRotationVector(sample_time*kp*error))), pre(q));
    rate = imu.gyro - gyro_bias;
  end when;
  annotation(Documentation(info = "<html>
<p>One tick, in this order:</p>
<pre>
q^- = q * exp((gyro - b) T)                 predict
e   = e_gravity(q^-) + e_heading(q^-)       error at the prediction
c  := c + T KII e
b  := limit(b - T (KI e + c))               bias
q   = q^- * exp(KP T e)                     correct
</pre>
<p>The same filter as the FMU <code>gcf</code> with its default options; the FMU also refuses samples that cannot be (free fall, a field along gravity, not a number).</p>
</html>"));
end GCF;
