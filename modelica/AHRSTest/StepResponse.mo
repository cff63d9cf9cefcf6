within AHRSTest;
model StepResponse "Continuous filters that start with a small error and a gyroscope bias"
  extends AHRS.Icons.Example;
  parameter AHRS.Types.Angle step = 1e-3 "Error of pitch at the start";
  parameter AHRS.Types.AngularVelocity bias = 1e-4 "Bias of the gyroscope about the axes of pitch and yaw";
  parameter AHRS.Types.Quaternion first_belief = AHRS.Functions.fromRotationVector({0, -step, 0}) "Attitude the filters believe in";
  AHRS.Sensors.IdealIMU imu(q = {1, 0, 0, 0}, rate = {0, bias, bias}, specific_force = {0, 0, -9.80665}) annotation(Placement(transformation(extent = {{-60, -20}, {-20, 20}})));
  AHRS.Filters.FirstOrderGCF first(kp = 0.5, initial_q = first_belief) annotation(Placement(transformation(extent = {{20, 40}, {60, 80}})));
  AHRS.Filters.SecondOrderGCF second(kp = 0.5, ki = 0.1, initial_q = first_belief) annotation(Placement(transformation(extent = {{20, -20}, {60, 20}})));
  AHRS.Filters.ThirdOrderGCF third(kp = 1, ki = 0.3, kii = 0.05, initial_q = first_belief) annotation(Placement(transformation(extent = {{20, -80}, {60, -40}})));
equation
  connect(imu.imu, first.imu) annotation(Line(points = {{-17, 0}, {0, 0}, {0, 60}, {16, 60}}, color = {200, 90, 0}));
  connect(imu.imu, second.imu) annotation(Line(points = {{-17, 0}, {16, 0}}, color = {200, 90, 0}));
  connect(imu.imu, third.imu) annotation(Line(points = {{-17, 0}, {0, 0}, {0, -60}, {16, -60}}, color = {200, 90, 0}));
  annotation(experiment(StopTime = 40, Interval = 0.1, Tolerance = 1e-10),
    Documentation(info = "<html><p>With so small an error the filters are linear: pitch answers an initial error and a bias, yaw a bias alone. Roll stays out of it,
because an error of roll shows in yaw as well, multiplied by the tangent of the dip.</p></html>"));
end StepResponse;
