within AHRS;
package Types "Quantities in SI units"
  extends Icons.Package;
  type Time = Real(final quantity = "Time", final unit = "s") "Time";
  type Frequency = Real(final quantity = "AngularVelocity", final unit = "rad/s") "Gain of a filter or frequency of a signal";
  type SquaredFrequency = Real(final unit = "rad2/s2") "Integral gain";
  type CubedFrequency = Real(final unit = "rad3/s3") "Gain of the double integral";
  type Angle = Real(final quantity = "Angle", final unit = "rad", displayUnit = "deg") "Angle";
  type AngularVelocity = Real(final quantity = "AngularVelocity", final unit = "rad/s", displayUnit = "deg/s") "Angular rate";
  type AngularAcceleration = Real(final quantity = "AngularAcceleration", final unit = "rad/s2") "Angular acceleration";
  type Length = Real(final quantity = "Length", final unit = "m") "Length or position";
  type Area = Real(final quantity = "Area", final unit = "m2", min = 0) "Area";
  type Velocity = Real(final quantity = "Velocity", final unit = "m/s") "Velocity";
  type Acceleration = Real(final quantity = "Acceleration", final unit = "m/s2") "Acceleration or specific force";
  type Mass = Real(final quantity = "Mass", final unit = "kg", min = 0) "Mass";
  type Inertia = Real(final quantity = "MomentOfInertia", final unit = "kg.m2", min = 0) "Moment of inertia";
  type AngularMomentum = Real(final quantity = "AngularMomentum", final unit = "kg.m2/s") "Angular momentum";
  type Density = Real(final quantity = "Density", final unit = "kg/m3", min = 0) "Density";
  type Force = Real(final quantity = "Force", final unit = "N") "Force";
  type Torque = Real(final quantity = "Torque", final unit = "N.m") "Torque";
  type MagneticFluxDensity = Real(final quantity = "MagneticFluxDensity", final unit = "T", displayUnit = "uT") "Magnetic flux density";
  type ThrustCoefficient = Real(final unit = "N.s2/rad2", min = 0) "Thrust over squared rotor speed";
  type TorqueCoefficient = Real(final unit = "N.m.s2/rad2", min = 0) "Torque over squared rotor speed";
  type RotorDragCoefficient = Real(final unit = "N.s2/(m.rad)", min = 0) "In-plane force over air speed and rotor speed";
  type Quaternion = Real[4](each final unit = "1") "Attitude: Hamilton, scalar first, turns body vectors into navigation vectors";
  type RotationVector = Real[3](each final unit = "rad") "Axis times angle";
  annotation(Icon(graphics = {Text(extent = {{-80, 60}, {80, -60}}, textColor = {0, 85, 150}, textString = "SI")}),
    Documentation(info = "<html><p>Everything inside the library is in SI units; degrees and microtesla appear as display units only.</p></html>"));
end Types;
