within AHRSTest;
model SampledFilters "Sampled filters on one sequence of samples"
  extends AHRS.Icons.Example;
  parameter AHRS.Types.Time sample_time = 0.02 "Sampling interval";
  AHRS.Filters.GCF gcf(sample_time = sample_time) annotation(Placement(transformation(extent = {{20, 20}, {60, 60}})));
  AHRS.Filters.GCF third(sample_time = sample_time, kp = 1, ki = 0.3, kii = 0.05) annotation(Placement(transformation(extent = {{20, -20}, {60, 20}})));
  AHRS.Filters.Mahony mahony(sample_time = sample_time) annotation(Placement(transformation(extent = {{20, -60}, {60, -20}})));
  AHRS.Sensors.IMU imu(sample_time = sample_time, errors = false) annotation(Placement(transformation(extent = {{-40, -20}, {0, 20}})));
protected
  AHRS.Types.Angle euler[3] "True roll, pitch, yaw";
equation
  euler = {0.9*sin(0.8*time), 0.6*sin(1.3*time), 2*sin(0.3*time)};
  imu.q = AHRS.Functions.fromEuler(euler);
  imu.rate = AHRS.Functions.bodyRate(euler, {0.72*cos(0.8*time), 0.78*cos(1.3*time), 0.6*cos(0.3*time)});
  imu.specific_force = AHRS.Functions.rotateBack(imu.q, {0.5*sin(2*time), 0.3*cos(3*time), -9.80665});
  connect(imu.imu, gcf.imu) annotation(Line(points = {{3, 0}, {8, 0}, {8, 40}, {16, 40}}, color = {200, 90, 0}));
  connect(imu.imu, third.imu) annotation(Line(points = {{3, 0}, {16, 0}}, color = {200, 90, 0}));
  connect(imu.imu, mahony.imu) annotation(Line(points = {{3, 0}, {8, 0}, {8, -40}, {16, -40}}, color = {200, 90, 0}));
  annotation(experiment(StopTime = 20, Interval = 0.02, Tolerance = 1e-6),
    Documentation(info = "<html><p>The samples are recorded with the result, so that another implementation can be fed with the very same numbers.</p></html>"));
end SampledFilters;
