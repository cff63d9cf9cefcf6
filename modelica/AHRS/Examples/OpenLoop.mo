within AHRS.Examples;
model OpenLoop "Rotor speeds that nobody corrects, and a filter that watches"
  extends Icons.Example;
  Plants.Quadrotor quadrotor annotation(Placement(transformation(extent = {{-60, -20}, {-20, 20}})));
  Sensors.IdealIMU imu annotation(Placement(transformation(extent = {{0, -20}, {40, 20}})));
  Filters.SecondOrderGCF filter(kp = 0.5, ki = 0.1) annotation(Placement(transformation(extent = {{60, -20}, {100, 20}})));
  Types.Angle euler[3] "True roll, pitch, yaw";
  Types.Angle error "Angle between estimate and truth";
  parameter Types.AngularVelocity hover = 434.27 "Speed that carries the vehicle";
equation
  quadrotor.rotor_speed_command = fill(hover, 4) + 0.8*cos(3*time)*{-1, 1, 1, -1} + 0.5*cos(2*time)*{1, -1, 1, -1} + 2*cos(time)*{1, 1, -1, -1};
  quadrotor.wind = zeros(3);
  connect(quadrotor.q, imu.q) annotation(Line(points = {{-18, 17}, {-11, 17}, {-11, 16}, {-4, 16}}, color = {0, 0, 127}));
  connect(quadrotor.rate, imu.rate) annotation(Line(points = {{-18, 11}, {-9, 11}, {-9, 0}, {-4, 0}}, color = {0, 0, 127}));
  connect(quadrotor.specific_force, imu.specific_force) annotation(Line(points = {{-18, 5}, {-14, 5}, {-14, -16}, {-4, -16}}, color = {0, 0, 127}));
  connect(imu.imu, filter.imu) annotation(Line(points = {{43, 0}, {56, 0}}, color = {200, 90, 0}));
  euler = Functions.toEuler(quadrotor.q);
  error = sqrt(Functions.toRotationVector(Functions.multiply(Functions.conjugate(filter.q), quadrotor.q))*Functions.toRotationVector(Functions.multiply(Functions.conjugate(filter.q), quadrotor.q)));
  annotation(experiment(StopTime = 4, Interval = 0.01, Tolerance = 1e-8),
    Documentation(info = "<html><p>Plot <code>euler</code> against <code>filter.euler</code>. A flying multirotor feels almost no horizontal specific force except its own drag, so the accelerometer says
\"level\" while the vehicle is tilted: with an ideal IMU the filter is still wrong by what the accelerometer does not see, slowly, at the rate KP.</p></html>"));
end OpenLoop;
