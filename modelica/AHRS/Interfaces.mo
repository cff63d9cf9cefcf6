within AHRS;
package Interfaces "Connectors and the faces that blocks have in common"
  extends Icons.Package;

  connector RealInput = input Real "Signal input, connects to Modelica.Blocks.Interfaces.RealOutput"
    annotation(defaultComponentName = "u", Icon(coordinateSystem(extent = {{-100, -100}, {100, 100}}), graphics = {
      Polygon(points = {{-100, 100}, {100, 0}, {-100, -100}}, lineColor = {0, 0, 127}, fillColor = {0, 0, 127}, fillPattern = FillPattern.Solid)}));
  connector RealOutput = output Real "Signal output, connects to Modelica.Blocks.Interfaces.RealInput"
    annotation(defaultComponentName = "y", Icon(coordinateSystem(extent = {{-100, -100}, {100, 100}}), graphics = {
      Polygon(points = {{-100, 100}, {100, 0}, {-100, -100}}, lineColor = {0, 0, 127}, fillColor = {255, 255, 255}, fillPattern = FillPattern.Solid)}));
  connector BooleanInput = input Boolean "Logical input, connects to Modelica.Blocks.Interfaces.BooleanOutput"
    annotation(defaultComponentName = "u", Icon(coordinateSystem(extent = {{-100, -100}, {100, 100}}), graphics = {
      Polygon(points = {{-100, 100}, {100, 0}, {-100, -100}}, lineColor = {255, 0, 255}, fillColor = {255, 0, 255}, fillPattern = FillPattern.Solid)}));
  connector BooleanOutput = output Boolean "Logical output, connects to Modelica.Blocks.Interfaces.BooleanInput"
    annotation(defaultComponentName = "y", Icon(coordinateSystem(extent = {{-100, -100}, {100, 100}}), graphics = {
      Polygon(points = {{-100, 100}, {100, 0}, {-100, -100}}, lineColor = {255, 0, 255}, fillColor = {255, 255, 255}, fillPattern = FillPattern.Solid)}));

  record IMUSignals "What an inertial measurement unit with magnetometer delivers, body axes"
    Types.AngularVelocity gyro[3] "Angular rate";
    Types.Acceleration accel[3] "Specific force";
    Types.MagneticFluxDensity mag[3] "Magnetic flux density";
    Boolean accel_valid "The accelerometer sample may be used";
    Boolean mag_valid "The magnetometer sample may be used";
    annotation(Documentation(info = "<html><p>The five signals every estimator of the project takes.</p></html>"));
  end IMUSignals;

  connector IMUInput = input IMUSignals "Bus from an IMU"
    annotation(defaultComponentName = "imu", Icon(coordinateSystem(extent = {{-100, -100}, {100, 100}}), graphics = {
      Polygon(points = {{-100, 100}, {100, 0}, {-100, -100}}, lineColor = {200, 90, 0}, fillColor = {255, 200, 80}, fillPattern = FillPattern.Solid)}));
  connector IMUOutput = output IMUSignals "Bus to estimators"
    annotation(defaultComponentName = "imu", Icon(coordinateSystem(extent = {{-100, -100}, {100, 100}}), graphics = {
      Polygon(points = {{-100, 100}, {100, 0}, {-100, -100}}, lineColor = {200, 90, 0}, fillColor = {255, 255, 255}, fillPattern = FillPattern.Solid)}));

  partial block Estimator "Face of every attitude estimator"
    extends Icons.Filter;
    IMUInput imu "Sensors" annotation(Placement(transformation(extent = {{-140, -20}, {-100, 20}})));
    RealOutput q[4](each final unit = "1") "Attitude" annotation(Placement(transformation(extent = {{100, 50}, {120, 70}})));
    RealOutput rate[3](each final unit = "rad/s") "Angular rate without the estimated bias" annotation(Placement(transformation(extent = {{100, -10}, {120, 10}})));
    RealOutput gyro_bias[3](each final unit = "rad/s") "Estimated bias of the gyroscope" annotation(Placement(transformation(extent = {{100, -70}, {120, -50}})));
    output Types.Angle euler[3] "Roll, pitch, yaw";
  equation
    euler = Functions.toEuler(q);
    annotation(Documentation(info = "<html><p>Estimators share this face, so that one replaces another in a diagram.</p></html>"));
  end Estimator;

  partial block Sensor "Face of an IMU on a vehicle"
    extends Icons.Block;
    parameter Types.MagneticFluxDensity field_magnitude = Parameters.IMU.field_magnitude "Magnitude of the local field";
    parameter Types.Angle field_dip = Parameters.IMU.field_dip "Dip of the local field below the horizon";
    parameter Types.Angle declination = Parameters.IMU.declination "Magnetic declination, east positive";
    RealInput q[4](each final unit = "1") "True attitude" annotation(Placement(transformation(extent = {{-140, 60}, {-100, 100}})));
    RealInput rate[3](each final unit = "rad/s") "True angular rate, body axes" annotation(Placement(transformation(extent = {{-140, -20}, {-100, 20}})));
    RealInput specific_force[3](each final unit = "m/s2") "True specific force at the sensor, body axes" annotation(Placement(transformation(extent = {{-140, -100}, {-100, -60}})));
    IMUOutput imu "Measured signals" annotation(Placement(transformation(extent = {{100, -15}, {130, 15}})));
  protected
    final parameter Types.MagneticFluxDensity field[3] = field_magnitude*{cos(field_dip)*cos(declination), cos(field_dip)*sin(declination), sin(field_dip)} "Earth's field, navigation axes";
    annotation(Icon(graphics = {
      Rectangle(extent = {{-50, 50}, {50, -50}}, lineColor = {80, 80, 80}, fillColor = {225, 225, 225}, fillPattern = FillPattern.Solid),
      Line(points = {{-30, -30}, {30, -30}}, color = {200, 90, 0}, thickness = 0.8, arrow = {Arrow.None, Arrow.Filled}),
      Line(points = {{-30, -30}, {-30, 32}}, color = {0, 85, 150}, thickness = 0.8, arrow = {Arrow.None, Arrow.Filled}),
      Line(points = {{-30, -30}, {12, 12}}, color = {75, 138, 73}, thickness = 0.8, arrow = {Arrow.None, Arrow.Filled})}),
      Documentation(info = "<html><p>Takes the truth of a vehicle and gives the bus of an IMU.</p></html>"));
  end Sensor;
  annotation(Icon(graphics = {
      Polygon(points = {{-60, 50}, {20, 0}, {-60, -50}, {-60, 50}}, lineColor = {0, 0, 127}, fillColor = {0, 0, 127}, fillPattern = FillPattern.Solid),
      Line(points = {{20, 0}, {75, 0}}, color = {0, 0, 127}, thickness = 1.0)}),
    Documentation(info = "<html><p><code>RealInput</code>, <code>RealOutput</code>, <code>BooleanInput</code> and <code>BooleanOutput</code> are defined as in
Modelica.Blocks.Interfaces (a connector that is an input or output of a built-in type) and therefore connect to them.</p></html>"));
end Interfaces;
