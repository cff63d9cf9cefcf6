within AHRS.Examples;
model BankAngle "Coordinated turn: the accelerometer sees no bank angle"
  extends Icons.Example;
  parameter Types.Velocity speed = 20 "Speed along the circle";
  parameter Types.Acceleration gravity = 9.80665 "Gravity";
  parameter Types.Angle bank = 0.5235987755982988 "Bank angle in the turn";
  parameter Types.Time begin = 5 "Start of the turn";
  parameter Types.Time ramp = 2 "Time to bank";
  Sensors.IdealIMU imu annotation(Placement(transformation(extent = {{-40, -20}, {0, 20}})));
  Filters.FirstOrderGCF slow(kp = 0.05) "Crossover far below the turn" annotation(Placement(transformation(extent = {{40, 20}, {80, 60}})));
  Filters.FirstOrderGCF fast(kp = 1) "Crossover above the turn" annotation(Placement(transformation(extent = {{40, -60}, {80, -20}})));
  Types.Angle roll "True roll";
  Types.Angle yaw(start = 0, fixed = true) "True yaw";
  Types.Angle slow_error "Error of the slow filter in roll";
  Types.Angle fast_error "Error of the fast filter in roll";
protected
  Real phase "Progress of the banking, 0 to 1";
  Types.AngularVelocity roll_rate "Derivative of roll";
  Types.AngularVelocity yaw_rate "Derivative of yaw";
equation
  phase = min(1.0, max(0.0, (time - begin)/ramp));
  roll = bank*0.5*(1 - cos(3.141592653589793*phase));
  roll_rate = if time > begin and time < begin + ramp then bank*0.5*3.141592653589793/ramp*sin(3.141592653589793*phase) else 0;
  yaw_rate = gravity*tan(roll)/speed;
  der(yaw) = yaw_rate;
  imu.q = Functions.fromEuler({roll, 0, yaw});
  imu.rate = Functions.bodyRate({roll, 0, yaw}, {roll_rate, 0, yaw_rate});
  imu.specific_force = Functions.rotateBack(imu.q, {-speed*yaw_rate*sin(yaw), speed*yaw_rate*cos(yaw), -gravity});
  connect(imu.imu, slow.imu) annotation(Line(points = {{3, 0}, {20, 0}, {20, 40}, {36, 40}}, color = {200, 90, 0}));
  connect(imu.imu, fast.imu) annotation(Line(points = {{3, 0}, {20, 0}, {20, -40}, {36, -40}}, color = {200, 90, 0}));
  slow_error = slow.euler[1] - roll;
  fast_error = fast.euler[1] - roll;
  annotation(experiment(StopTime = 30, Interval = 0.02, Tolerance = 1e-8),
    Documentation(info = "<html>
<p>In a coordinated turn lift carries weight and centripetal force together, the specific force stays along the body's down axis, and an accelerometer cannot tell the turn from level flight:</p>
<pre>
tan(bank) = V yaw'/g        f_y = 0
</pre>
<p>Plot <code>slow_error</code> and <code>fast_error</code>: the higher the crossover KP, the sooner the filter believes the accelerometer and levels the horizon.</p>
</html>"));
end BankAngle;
