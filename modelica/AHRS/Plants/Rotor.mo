within AHRS.Plants;
model Rotor "Motor and propeller: first-order lag, thrust, drag in the rotor plane, torque"
  extends Icons.Block;
  parameter Types.Length position[3] = zeros(3) "Place of the hub, body axes";
  parameter Real direction = 1 "Sense of rotation about the body's z axis: +1 or -1";
  parameter Types.ThrustCoefficient thrust_coefficient = Parameters.Quadrotor.thrust_coefficient "Thrust over squared speed";
  parameter Types.TorqueCoefficient torque_coefficient = Parameters.Quadrotor.torque_coefficient "Drag torque over squared speed";
  parameter Types.RotorDragCoefficient rotor_drag_coefficient = Parameters.Quadrotor.rotor_drag_coefficient "Drag in the rotor plane";
  parameter Types.Inertia rotor_inertia = Parameters.Quadrotor.rotor_inertia "Inertia about the shaft";
  parameter Types.Time rotor_time_constant = Parameters.Quadrotor.rotor_time_constant "Time constant of the speed";
  parameter Types.AngularVelocity rotor_speed_min = Parameters.Quadrotor.rotor_speed_min "Lowest speed command";
  parameter Types.AngularVelocity rotor_speed_max = Parameters.Quadrotor.rotor_speed_max "Highest speed command";
  parameter Types.AngularVelocity initial_rotor_speed = Parameters.Quadrotor.initial_rotor_speed "Speed at the start";
  Interfaces.RealInput command(final unit = "rad/s") "Commanded speed" annotation(Placement(transformation(extent = {{-140, 60}, {-100, 100}})));
  Interfaces.RealInput air_velocity[3](each final unit = "m/s") "Velocity of the centre of mass through the air, body axes" annotation(Placement(transformation(extent = {{-140, -20}, {-100, 20}})));
  Interfaces.RealInput rate[3](each final unit = "rad/s") "Angular rate of the body" annotation(Placement(transformation(extent = {{-140, -100}, {-100, -60}})));
  Interfaces.RealOutput force[3](each final unit = "N") "Force on the body, body axes" annotation(Placement(transformation(extent = {{100, 70}, {120, 90}})));
  Interfaces.RealOutput torque[3](each final unit = "N.m") "Moment on the body about its centre of mass" annotation(Placement(transformation(extent = {{100, 20}, {120, 40}})));
  Interfaces.RealOutput momentum(final unit = "kg.m2/s") "Angular momentum about the body's z axis" annotation(Placement(transformation(extent = {{100, -40}, {120, -20}})));
  Interfaces.RealOutput speed(start = initial_rotor_speed, fixed = true, final unit = "rad/s") "Speed" annotation(Placement(transformation(extent = {{100, -90}, {120, -70}})));
protected
  Types.Velocity hub_velocity[3] "Velocity of the hub through the air, body axes";
equation
  der(speed) = (min(rotor_speed_max, max(rotor_speed_min, command)) - speed)/rotor_time_constant;
  hub_velocity = air_velocity + cross(rate, position);
  force = {-rotor_drag_coefficient*speed*hub_velocity[1], -rotor_drag_coefficient*speed*hub_velocity[2], -thrust_coefficient*speed^2};
  torque = cross(position, force) + {0, 0, -direction*(torque_coefficient*speed^2 + rotor_inertia*der(speed))};
  momentum = direction*rotor_inertia*speed;
  annotation(
    Icon(graphics = {
      Ellipse(extent = {{-80, 30}, {80, -10}}, lineColor = {0, 85, 150}, fillColor = {210, 230, 245}, fillPattern = FillPattern.Solid),
      Rectangle(extent = {{-12, 10}, {12, -60}}, lineColor = {80, 80, 80}, fillColor = {160, 160, 160}, fillPattern = FillPattern.Solid),
      Line(points = {{0, 20}, {0, 80}}, color = {200, 90, 0}, thickness = 0.8, arrow = {Arrow.None, Arrow.Filled})}),
    Documentation(info = "<html>
<p>With the speed <code>W</code>, the hub's velocity through the air <code>u = u_0 + w x r</code> and the sense of rotation <code>s</code>:</p>
<pre>
W' = (W_command - W)/tau
F = (-k_D W u_x, -k_D W u_y, -k_T W^2)
M = r x F - s (k_Q W^2 + J W') e_z
</pre>
<p>The last term of M is the reaction of the frame to the rotor's acceleration.</p>
</html>"));
end Rotor;
