within AHRS.Controllers;
block AttitudeController "Cascade of attitude and rate controller with feed-forward and motor mixer"
  extends Icons.Block;
  parameter Types.Time sample_time = Parameters.AttitudeController.sample_time "Sampling interval";
  parameter Types.Frequency attitude_gain[3] = Parameters.AttitudeController.attitude_gain "Rate per attitude error";
  parameter Types.Frequency rate_gain[3] = Parameters.AttitudeController.rate_gain "Angular acceleration per rate error";
  parameter Types.SquaredFrequency rate_integral_gain[3] = Parameters.AttitudeController.rate_integral_gain "Integral gain of the rate";
  parameter Types.AngularVelocity rate_limit[3] = Parameters.AttitudeController.rate_limit "Greatest wanted rate";
  parameter Types.AngularAcceleration integral_limit[3] = Parameters.AttitudeController.integral_limit "Greatest integral part";
  parameter Types.Inertia inertia[3] = Parameters.AttitudeController.inertia "Moments of inertia of the vehicle";
  parameter Types.Length arm_length = Parameters.AttitudeController.arm_length "From the centre to a rotor";
  parameter Types.ThrustCoefficient thrust_coefficient = Parameters.AttitudeController.thrust_coefficient "Thrust over squared rotor speed";
  parameter Types.TorqueCoefficient torque_coefficient = Parameters.AttitudeController.torque_coefficient "Drag torque over squared rotor speed";
  parameter Types.AngularVelocity rotor_speed_min = Parameters.AttitudeController.rotor_speed_min "Lowest rotor speed";
  parameter Types.AngularVelocity rotor_speed_max = Parameters.AttitudeController.rotor_speed_max "Highest rotor speed";
  parameter Types.Force initial_thrust = Parameters.AttitudeController.initial_thrust "Thrust before the first tick";
  Interfaces.RealInput q_ref[4](each final unit = "1") "Wanted attitude" annotation(Placement(transformation(extent = {{-140, 70}, {-100, 110}})));
  Interfaces.RealInput rate_ref[3](each final unit = "rad/s") "Rate of the wanted attitude, its own axes" annotation(Placement(transformation(extent = {{-140, 35}, {-100, 75}})));
  Interfaces.RealInput angular_acceleration_ref[3](each final unit = "rad/s2") "Angular acceleration of the wanted attitude, its own axes" annotation(Placement(transformation(extent = {{-140, 0}, {-100, 40}})));
  Interfaces.RealInput thrust(final unit = "N") "Wanted total thrust" annotation(Placement(transformation(extent = {{-140, -35}, {-100, 5}})));
  Interfaces.RealInput q[4](each final unit = "1") "Estimated attitude" annotation(Placement(transformation(extent = {{-140, -75}, {-100, -35}})));
  Interfaces.RealInput rate[3](each final unit = "rad/s") "Estimated rate, body axes" annotation(Placement(transformation(extent = {{-140, -110}, {-100, -70}})));
  Interfaces.RealOutput rotor_speed_command[4](each final unit = "rad/s") "Rotor speeds" annotation(Placement(transformation(extent = {{100, -10}, {120, 10}})));
protected
  final parameter Types.Force thrust_min = thrust_coefficient*rotor_speed_min^2 "Least thrust of a rotor";
  final parameter Types.Force thrust_max = thrust_coefficient*rotor_speed_max^2 "Greatest thrust of a rotor";
  final parameter Types.AngularVelocity initial_speed = min(rotor_speed_max, max(rotor_speed_min, sqrt(initial_thrust/(4*thrust_coefficient)))) "Command before the first tick";
  discrete Real difference[4](start = {1, 0, 0, 0}, each fixed = true) "From the estimated to the wanted attitude";
  discrete Real rate_error[3](each start = 0, each fixed = true) "Wanted minus estimated rate";
  discrete Real torque[3](each start = 0, each fixed = true) "Wanted moment";
  discrete Real integral[3](each start = 0, each fixed = true) "Integral of the rate error";
  discrete Real mixed[7](each start = 1, each fixed = true) "Result of the mixer";
  discrete Real command[4](start = fill(initial_speed, 4), each fixed = true) "Rotor speeds from this tick on";
equation
  when sample(sample_time, sample_time) then
    difference = Functions.shortest(Functions.multiply(Functions.conjugate(q), q_ref));
    rate_error = Functions.limit(2*attitude_gain .* difference[2:4] + Functions.rotate(difference, rate_ref), rate_limit) - rate;
    torque = inertia .* (rate_gain .* rate_error + pre(integral) + Functions.rotate(difference, angular_acceleration_ref)) + cross(rate, inertia .* rate);
    mixed = mix(thrust, torque, arm_length/sqrt(2), torque_coefficient/thrust_coefficient, thrust_min, thrust_max);
    integral = Functions.limit(pre(integral) + sample_time*rate_integral_gain .* rate_error
      .* {if mixed[6] < 1 then 0.0 else 1.0, if mixed[6] < 1 then 0.0 else 1.0, if mixed[7] < 1 then 0.0 else 1.0}, integral_limit);
    command = {sqrt(mixed[1]/thrust_coefficient), sqrt(mixed[2]/thrust_coefficient), sqrt(mixed[3]/thrust_coefficient), sqrt(mixed[4]/thrust_coefficient)};
  end when;
  rotor_speed_command = pre(command);
  annotation(
    Icon(graphics = {
      Ellipse(extent = {{-80, 20}, {-40, -20}}, lineColor = {80, 80, 80}, thickness = 0.8),
      Rectangle(extent = {{-10, 30}, {50, -30}}, lineColor = {0, 85, 150}, thickness = 0.8),
      Line(points = {{-40, 0}, {-10, 0}}, color = {80, 80, 80}, thickness = 0.8),
      Line(points = {{50, 0}, {85, 0}}, color = {80, 80, 80}, thickness = 0.8, arrow = {Arrow.None, Arrow.Filled}),
      Line(points = {{68, 0}, {68, -60}, {-60, -60}, {-60, -22}}, color = {80, 80, 80}, thickness = 0.8, arrow = {Arrow.None, Arrow.Filled})}),
    Documentation(info = "<html>
<pre>
d     = q* q_ref                             with d_0 &gt;= 0
w_sp  = limit(2 K_a .* d_v + C(d) rate_ref)
eps   = w_sp - rate
M     = I (K_r .* eps + z + C(d) angular_acceleration_ref) + rate x I rate
z    := limit(z + T K_i .* eps)              not on an axis that the mixer cut
</pre>
<p><a href=\"modelica://AHRS.Controllers.mix\">mix</a> turns M and the thrust into rotor speeds. The output changes just after the tick, so that what a sensor samples at the
tick does not depend on it.</p>
</html>"));
end AttitudeController;
