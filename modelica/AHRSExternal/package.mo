within;
package AHRSExternal "The estimators' C reference inside Modelica, for tools that compile C"
  extends AHRS.Icons.Package;

  class Instance "An estimator in C"
    extends ExternalObject;

    function constructor "Make an estimator and set its parameters"
      extends AHRS.Icons.Function;
      input String kind "Name of the estimator, such as gcf";
      input String names[:] "Parameters that differ from their defaults, such as kp or q0[2]";
      input Real values[size(names, 1)] "Their values; for an enumeration the number of the item";
      output Instance object "The estimator";
      external "C" object = ahrs_external_create(kind, names, size(names, 1), values)
        annotation(Include = "#include \"ahrs.h\"", IncludeDirectory = "modelica://AHRSExternal/Resources/Include");
      annotation(Documentation(info = "<html><p>An unknown name or a value outside its limits stops the simulation with a message that says which.</p></html>"));
    end constructor;

    function destructor "Release an estimator"
      extends AHRS.Icons.Function;
      input Instance object "The estimator";
      external "C" ahrs_external_destroy(object)
        annotation(Include = "#include \"ahrs.h\"", IncludeDirectory = "modelica://AHRSExternal/Resources/Include");
      annotation(Documentation(info = "<html><p>Called by the tool when the simulation ends.</p></html>"));
    end destructor;
    annotation(Documentation(info = "<html><p>The tool calls <code>constructor</code> and <code>destructor</code>; <a href=\"modelica://AHRSExternal.step\">step</a> is what a block calls.</p></html>"));
  end Instance;

  impure function step "One sample"
    extends AHRS.Icons.Function;
    input Instance object "The estimator";
    input Real dt(unit = "s") "Time since the last sample";
    input Real gyro[3](each unit = "rad/s") "Angular rate, body axes";
    input Real accel[3](each unit = "m/s2") "Specific force, body axes";
    input Real mag[3](each unit = "T") "Magnetic flux density, body axes";
    input Boolean accel_valid "The accelerometer sample may be used";
    input Boolean mag_valid "The magnetometer sample may be used";
    output Real y[11] "Attitude (4), rate (3), gyroscope bias (3), status";
    external "C" ahrs_external_step(object, dt, gyro, accel, mag, accel_valid, mag_valid, y)
      annotation(Include = "#include \"ahrs.h\"", IncludeDirectory = "modelica://AHRSExternal/Resources/Include");
    annotation(Documentation(info = "<html><p>Changes the estimator, hence impure: to be called once per sample, inside <code>when</code>.</p></html>"));
  end step;

  block Estimator "Any estimator of the C reference, by name"
    extends AHRS.Interfaces.Estimator(q(start = {1, 0, 0, 0}, each fixed = true), rate(each start = 0, each fixed = true), gyro_bias(each start = 0, each fixed = true));
    parameter String kind = "gcf" "Name of the estimator";
    parameter AHRS.Types.Time sample_time = 0.01 "Sampling interval";
    parameter String names[:] = {"sample_time"} "Parameters that differ from their defaults";
    parameter Real values[size(names, 1)] = {sample_time} "Their values";
    discrete output Real status(start = 9, fixed = true) "Status, as numbered by the FMUs";
  protected
    Instance estimator = Instance(kind, names, values) "The estimator in C";
    discrete Real y[11](each start = 0, each fixed = true) "What the last step gave";
  equation
    when sample(sample_time, sample_time) then
      y = step(estimator, sample_time, imu.gyro, imu.accel, imu.mag, imu.accel_valid, imu.mag_valid);
      q = y[1:4];
      rate = y[5:7];
      gyro_bias = y[8:10];
      status = y[11];
    end when;
    annotation(Documentation(info = "<html>
<p>The very code of the FMUs: results are equal to the last bit. Names of estimators and parameters are those of the FMUs; the vectors <code>names</code> and
<code>values</code> set any of them.</p>
<pre>
AHRSExternal.Estimator filter(kind = \"gcf\", sample_time = 0.004, names = {\"sample_time\", \"kp\"}, values = {0.004, 0.3});
</pre>
</html>"));
  end Estimator;

  block GCF "Generalized complementary filter"
    extends Estimator(final kind = "gcf", final names = {"sample_time", "kp", "ki", "kii", "bias_limit"},
      final values = {sample_time, kp, ki, kii, bias_limit});
    parameter AHRS.Types.Frequency kp = AHRS.Parameters.GCF.kp "Proportional gain";
    parameter AHRS.Types.SquaredFrequency ki = AHRS.Parameters.GCF.ki "Integral gain; zero gives the first order";
    parameter AHRS.Types.CubedFrequency kii = AHRS.Parameters.GCF.kii "Gain of the double integral; zero gives the second order";
    parameter AHRS.Types.AngularVelocity bias_limit = AHRS.Parameters.GCF.bias_limit "Largest bias that is learned";
    annotation(Documentation(info = "<html><p>Takes the place of <a href=\"modelica://AHRS.Filters.GCF\">AHRS.Filters.GCF</a> with the same parameters and the same result.</p></html>"));
  end GCF;

  model Comparison "Both GCFs on one flight"
    extends AHRS.Examples.ClosedLoopQuadrotor;
    GCF reference_filter(sample_time = sample_time) "The C reference beside the block" annotation(Placement(transformation(extent = {{-120, -80}, {-80, -40}})));
    Real difference "Greatest difference of a quaternion's element";
  equation
    connect(imu.imu, reference_filter.imu) annotation(Line(points = {{103, 0}, {112, 0}, {112, -90}, {-132, -90}, {-132, -60}, {-124, -60}}, color = {200, 90, 0}));
    difference = max(abs(reference_filter.q - filter.q));
    annotation(experiment(StopTime = 10, Interval = 0.004, Tolerance = 1e-10),
      Documentation(info = "<html><p><code>difference</code> stays at rounding level.</p></html>"));
  end Comparison;
  annotation(
    version = "0.1.0",
    uses(AHRS(version = "0.1.0")),
    Icon(graphics = {Text(extent = {{-80, 60}, {80, -60}}, textColor = {0, 85, 150}, textString = "C")}),
    Documentation(info = "<html>
<p>For OpenModelica, Dymola and every tool that compiles C: the library brings its own source in <code>Resources/Include</code> and needs nothing else.
A tool without a C compiler takes <code>AHRS</code>, or the FMUs.</p>
</html>"));
end AHRSExternal;
