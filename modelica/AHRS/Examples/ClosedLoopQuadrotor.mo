within AHRS.Examples;
model ClosedLoopQuadrotor "Quadrotor that flies on an estimated attitude"
  extends Icons.Example;
  parameter Types.Time sample_time = 0.004 "Tick of sensor, filter and controller";
  parameter Boolean sensor_errors = false "The IMU has bias, drift and noise";
  Plants.Quadrotor quadrotor annotation(Placement(transformation(extent = {{0, -20}, {40, 20}})));
  Sensors.IMU imu(sample_time = sample_time, errors = sensor_errors) annotation(Placement(transformation(extent = {{60, -20}, {100, 20}})));
  Filters.GCF filter(sample_time = sample_time) annotation(Placement(transformation(extent = {{-120, -20}, {-80, 20}})));
  Controllers.AttitudeController controller(sample_time = sample_time) annotation(Placement(transformation(extent = {{-60, -20}, {-20, 20}})));
  Types.Angle reference[3] "Wanted roll, pitch, yaw";
  Types.Angle euler[3] "True roll, pitch, yaw";
  Types.RotationVector estimation_error "From the estimated to the true attitude, body axes";
protected
  Types.AngularVelocity reference_rate[3] "Derivatives of the reference";
equation
  reference = {0.3*sin(1.5*time), 0.2*sin(1.1*time), 0.5*sin(0.4*time)};
  reference_rate = {0.45*cos(1.5*time), 0.22*cos(1.1*time), 0.2*cos(0.4*time)};
  controller.q_ref = Functions.fromEuler(reference);
  controller.rate_ref = Functions.bodyRate(reference, reference_rate);
  controller.angular_acceleration_ref = zeros(3);
  controller.thrust = quadrotor.mass*quadrotor.gravity/(cos(reference[1])*cos(reference[2]));
  quadrotor.wind = zeros(3);
  connect(controller.rotor_speed_command, quadrotor.rotor_speed_command) annotation(Line(points = {{-18, 0}, {-12, 0}, {-12, 10}, {-4, 10}}, color = {0, 0, 127}));
  connect(quadrotor.q, imu.q) annotation(Line(points = {{42, 17}, {48, 17}, {48, 16}, {56, 16}}, color = {0, 0, 127}));
  connect(quadrotor.rate, imu.rate) annotation(Line(points = {{42, 11}, {51, 11}, {51, 0}, {56, 0}}, color = {0, 0, 127}));
  connect(quadrotor.specific_force, imu.specific_force) annotation(Line(points = {{42, 5}, {46, 5}, {46, -16}, {56, -16}}, color = {0, 0, 127}));
  connect(imu.imu, filter.imu) annotation(Line(points = {{103, 0}, {112, 0}, {112, -50}, {-132, -50}, {-132, 0}, {-124, 0}}, color = {200, 90, 0}));
  connect(filter.q, controller.q) annotation(Line(points = {{-78, 12}, {-70, 12}, {-70, -11}, {-64, -11}}, color = {0, 0, 127}));
  connect(filter.rate, controller.rate) annotation(Line(points = {{-78, 0}, {-74, 0}, {-74, -18}, {-64, -18}}, color = {0, 0, 127}));
  euler = Functions.toEuler(quadrotor.q);
  estimation_error = Functions.toRotationVector(Functions.multiply(Functions.conjugate(filter.q), quadrotor.q));
  annotation(Diagram(coordinateSystem(extent = {{-140, -100}, {120, 100}})), experiment(StopTime = 10, Interval = 0.004, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Plant, IMU, filter and controller in a ring. Plot <code>reference</code> against <code>euler</code>, and <code>estimation_error</code>. Set <code>sensor_errors</code>, or replace
<code>filter</code>, and see what the vehicle makes of it.</p>
<p>At a tick the IMU samples the vehicle, the filter takes the sample and the controller takes the estimate; the new rotor speeds act from just after the tick on.</p>
</html>"));
end ClosedLoopQuadrotor;
