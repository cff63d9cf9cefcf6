within AHRS.Sensors;
block IMU "Sampled IMU with bias, drift, scale error, hard iron and seeded noise"
  extends Interfaces.Sensor;
  parameter Types.Time sample_time = Parameters.IMU.sample_time "Sampling interval";
  parameter Boolean errors = Parameters.IMU.errors "False: a perfect sensor that samples";
  parameter Real gyro_noise_density(min = 0) = Parameters.IMU.gyro_noise_density "White noise of the gyroscope, rad/s/sqrt(Hz)";
  parameter Real gyro_bias_walk(min = 0) = Parameters.IMU.gyro_bias_walk "Random walk of the gyroscope's bias, rad/s2/sqrt(Hz)";
  parameter Types.AngularVelocity gyro_bias[3] = Parameters.IMU.gyro_bias "Constant bias of the gyroscope";
  parameter Real gyro_scale[3] = Parameters.IMU.gyro_scale "Relative scale error of the gyroscope";
  parameter Real accel_noise_density(min = 0) = Parameters.IMU.accel_noise_density "White noise of the accelerometer, m/s2/sqrt(Hz)";
  parameter Types.Acceleration accel_bias[3] = Parameters.IMU.accel_bias "Constant bias of the accelerometer";
  parameter Real accel_scale[3] = Parameters.IMU.accel_scale "Relative scale error of the accelerometer";
  parameter Types.MagneticFluxDensity mag_noise_std(min = 0) = Parameters.IMU.mag_noise_std "White noise of the magnetometer per sample";
  parameter Types.MagneticFluxDensity hard_iron[3] = Parameters.IMU.hard_iron "Field that the vehicle adds, body axes";
  parameter Integer seed = Parameters.IMU.seed "Seed of the noise";
protected
  final parameter Real on = if errors then 1 else 0 "Weight of every error";
  final parameter Real first_state[2] = Functions.randomState(seed) "Where the noise starts";
  discrete Real state[2](start = first_state, each fixed = true) "State of the generator";
  discrete Real random[14](each start = 0, each fixed = true) "Twelve normal numbers and the generator's next state";
  discrete Real sampled_q[4](start = {1, 0, 0, 0}, each fixed = true) "Attitude at the last sample";
  discrete Real mean_rate[3](each start = 0, each fixed = true) "Mean rate since the last sample";
  discrete Real drift[3](each start = 0, each fixed = true) "Drift of the gyroscope";
  Boolean started(start = false, fixed = true) "There was a last sample";
equation
  when sample(sample_time, sample_time) then
    started = true;
    random = if errors then Functions.randomNumbers(pre(state), 12) else zeros(14);
    state = {random[13], random[14]};
    sampled_q = q;
    mean_rate = if pre(started) then Functions.toRotationVector(Functions.multiply(Functions.conjugate(pre(sampled_q)), q))/sample_time else rate;
    drift = pre(drift) + gyro_bias_walk*sqrt(sample_time)*random[1:3];
    imu.gyro = mean_rate + on*(gyro_scale .* mean_rate + gyro_bias + drift + gyro_noise_density/sqrt(sample_time)*random[4:6]);
    imu.accel = specific_force + on*(accel_scale .* specific_force + accel_bias + accel_noise_density/sqrt(sample_time)*random[7:9]);
    imu.mag = Functions.rotateBack(q, field) + on*(hard_iron + mag_noise_std*random[10:12]);
    imu.accel_valid = true;
    imu.mag_valid = true;
  end when;
  annotation(
    Icon(graphics = {Line(points = {{-90, -75}, {-70, -60}, {-50, -88}, {-30, -65}, {-10, -82}, {10, -58}, {30, -90}, {50, -66}, {70, -84}, {90, -70}}, color = {150, 150, 150})}),
    Documentation(info = "<html>
<p>The gyroscope gives the mean rate over its interval, as a device that integrates does:</p>
<pre>
w_k    = 2 atan2(|d_v|, d_0) d_v/|d_v| / T      with d = q_(k-1)* q_k
gyro   = (1 + s) w_k + b + drift + N n/sqrt(T)
drift := drift + K sqrt(T) n
accel  = (1 + s) f + b + N n/sqrt(T)
mag    = q* B q + h + S n
</pre>
<p><code>n</code> are independent standard normal numbers of the generator in <a href=\"modelica://AHRS.Functions.randomNumbers\">randomNumbers</a>:
the same seed gives the same noise in every tool. <code>errors = false</code> switches them all off. The FMU <code>imu</code> has more errors (bandwidth, delay, quantisation, saturation, vibration) and another generator.</p>
</html>"));
end IMU;
