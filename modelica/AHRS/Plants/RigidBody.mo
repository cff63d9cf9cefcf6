within AHRS.Plants;
model RigidBody "Rigid body with six degrees of freedom, attitude as a quaternion"
  extends Icons.Block;
  parameter Types.Mass mass = Parameters.Quadrotor.mass "Mass";
  parameter Types.Inertia inertia[3] = Parameters.Quadrotor.inertia "Principal moments of inertia about the centre of mass";
  parameter Types.Acceleration gravity = Parameters.Quadrotor.gravity "Gravity, downward";
  parameter Types.Length initial_position[3] = Parameters.Quadrotor.initial_position "Position at the start";
  parameter Types.Velocity initial_velocity[3] = Parameters.Quadrotor.initial_velocity "Velocity at the start";
  parameter Types.Quaternion initial_q = Parameters.Quadrotor.initial_q "Attitude at the start";
  parameter Types.AngularVelocity initial_rate[3] = Parameters.Quadrotor.initial_rate "Angular rate at the start";
  Interfaces.RealInput force[3](each final unit = "N") "Force without gravity, body axes" annotation(Placement(transformation(extent = {{-140, 30}, {-100, 70}})));
  Interfaces.RealInput torque[3](each final unit = "N.m") "Moment about the centre of mass, body axes" annotation(Placement(transformation(extent = {{-140, -70}, {-100, -30}})));
  Interfaces.RealOutput position[3](start = initial_position, each fixed = true, each final unit = "m") "Position of the centre of mass, navigation axes" annotation(Placement(transformation(extent = {{100, 70}, {120, 90}})));
  Interfaces.RealOutput velocity[3](start = initial_velocity, each fixed = true, each final unit = "m/s") "Velocity, navigation axes" annotation(Placement(transformation(extent = {{100, 30}, {120, 50}})));
  Interfaces.RealOutput q[4](start = initial_q, each fixed = true, each final unit = "1") "Attitude" annotation(Placement(transformation(extent = {{100, -10}, {120, 10}})));
  Interfaces.RealOutput rate[3](start = initial_rate, each fixed = true, each final unit = "rad/s") "Angular rate, body axes" annotation(Placement(transformation(extent = {{100, -50}, {120, -30}})));
  Interfaces.RealOutput angular_acceleration[3](each final unit = "rad/s2") "Angular acceleration, body axes" annotation(Placement(transformation(extent = {{100, -90}, {120, -70}})));
equation
  der(position) = velocity;
  der(velocity) = Functions.rotate(q, force)/mass + {0, 0, gravity};
  der(q) = Functions.derivative(q, rate);
  der(rate) = angular_acceleration;
  inertia .* angular_acceleration + cross(rate, inertia .* rate) = torque;
  annotation(
    Icon(graphics = {
      Polygon(points = {{-60, 20}, {0, 50}, {60, 20}, {60, -30}, {0, -60}, {-60, -30}, {-60, 20}}, lineColor = {80, 80, 80}, fillColor = {225, 225, 225}, fillPattern = FillPattern.Solid),
      Line(points = {{-60, 20}, {0, -10}, {60, 20}}, color = {80, 80, 80}),
      Line(points = {{0, -10}, {0, -60}}, color = {80, 80, 80})}),
    Documentation(info = "<html>
<p>Newton's law in navigation axes, Euler's in body axes, kinematics on the quaternion:</p>
<pre>
p' = v
v' = (0, 0, g) + q F q*/m
q' = 1/2 q * (0, w)
I w' + w x I w = M
</pre>
</html>"));
end RigidBody;
