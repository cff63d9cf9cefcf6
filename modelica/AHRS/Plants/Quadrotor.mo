within AHRS.Plants;
model Quadrotor "Quadrotor: rigid body, four rotors, body drag and wind"
  extends Icons.Block;
  parameter Types.Mass mass = Parameters.Quadrotor.mass "Mass";
  parameter Types.Inertia inertia[3] = Parameters.Quadrotor.inertia "Principal moments of inertia";
  parameter Types.Length arm_length = Parameters.Quadrotor.arm_length "From the centre to a rotor, seen from above";
  parameter Types.Length rotor_height = Parameters.Quadrotor.rotor_height "Rotor plane above the centre of mass";
  parameter Types.ThrustCoefficient thrust_coefficient = Parameters.Quadrotor.thrust_coefficient "Thrust over squared rotor speed";
  parameter Types.TorqueCoefficient torque_coefficient = Parameters.Quadrotor.torque_coefficient "Drag torque over squared rotor speed";
  parameter Types.RotorDragCoefficient rotor_drag_coefficient = Parameters.Quadrotor.rotor_drag_coefficient "Drag in the rotor plane";
  parameter Types.Inertia rotor_inertia = Parameters.Quadrotor.rotor_inertia "Inertia of a rotor about its shaft";
  parameter Types.Time rotor_time_constant = Parameters.Quadrotor.rotor_time_constant "Time constant of the rotor speed";
  parameter Types.AngularVelocity rotor_speed_min = Parameters.Quadrotor.rotor_speed_min "Lowest speed command";
  parameter Types.AngularVelocity rotor_speed_max = Parameters.Quadrotor.rotor_speed_max "Highest speed command";
  parameter Types.Area drag_area[3] = Parameters.Quadrotor.drag_area "Drag coefficient times area, body axes";
  parameter Types.Density air_density = Parameters.Quadrotor.air_density "Density of the air";
  parameter Types.Acceleration gravity = Parameters.Quadrotor.gravity "Gravity";
  parameter Types.Length imu_position[3] = Parameters.Quadrotor.imu_position "Place of the IMU, body axes";
  parameter Types.Length initial_position[3] = Parameters.Quadrotor.initial_position "Position at the start";
  parameter Types.Velocity initial_velocity[3] = Parameters.Quadrotor.initial_velocity "Velocity at the start";
  parameter Types.Quaternion initial_q = Parameters.Quadrotor.initial_q "Attitude at the start";
  parameter Types.AngularVelocity initial_rate[3] = Parameters.Quadrotor.initial_rate "Angular rate at the start";
  parameter Types.AngularVelocity initial_rotor_speed = Parameters.Quadrotor.initial_rotor_speed "Rotor speed at the start";
  Interfaces.RealInput rotor_speed_command[4](each final unit = "rad/s") "Commanded rotor speeds" annotation(Placement(transformation(extent = {{-140, 30}, {-100, 70}})));
  Interfaces.RealInput wind[3](each final unit = "m/s") "Velocity of the air, navigation axes" annotation(Placement(transformation(extent = {{-140, -70}, {-100, -30}})));
  Interfaces.RealOutput q[4](each final unit = "1") "Attitude" annotation(Placement(transformation(extent = {{100, 75}, {120, 95}})));
  Interfaces.RealOutput rate[3](each final unit = "rad/s") "Angular rate, body axes" annotation(Placement(transformation(extent = {{100, 45}, {120, 65}})));
  Interfaces.RealOutput specific_force[3](each final unit = "m/s2") "Specific force at the IMU, body axes" annotation(Placement(transformation(extent = {{100, 15}, {120, 35}})));
  Interfaces.RealOutput velocity[3](each final unit = "m/s") "Velocity, navigation axes" annotation(Placement(transformation(extent = {{100, -35}, {120, -15}})));
  Interfaces.RealOutput position[3](each final unit = "m") "Position, navigation axes" annotation(Placement(transformation(extent = {{100, -65}, {120, -45}})));
  Interfaces.RealOutput rotor_speed[4](each final unit = "rad/s") "Rotor speeds" annotation(Placement(transformation(extent = {{100, -95}, {120, -75}})));
  RigidBody body(mass = mass, inertia = inertia, gravity = gravity, initial_position = initial_position, initial_velocity = initial_velocity,
    initial_q = initial_q, initial_rate = initial_rate) "Frame" annotation(Placement(transformation(extent = {{20, -20}, {60, 20}})));
  Rotor rotor[4](position = {{d, d, -rotor_height}, {-d, -d, -rotor_height}, {d, -d, -rotor_height}, {-d, d, -rotor_height}},
    direction = {-1, -1, 1, 1}, each thrust_coefficient = thrust_coefficient, each torque_coefficient = torque_coefficient,
    each rotor_drag_coefficient = rotor_drag_coefficient, each rotor_inertia = rotor_inertia, each rotor_time_constant = rotor_time_constant,
    each rotor_speed_min = rotor_speed_min, each rotor_speed_max = rotor_speed_max, each initial_rotor_speed = initial_rotor_speed)
    "Front right, rear left, front left, rear right" annotation(Placement(transformation(extent = {{-60, -20}, {-20, 20}})));
protected
  final parameter Types.Length d = arm_length/sqrt(2) "Front and right distance of the rotors";
  Types.Velocity air_velocity[3] "Velocity through the air, body axes";
  Types.AngularMomentum momentum[3] "Angular momentum of the rotors, body axes";
equation
  air_velocity = Functions.rotateBack(body.q, body.velocity - wind);
  momentum = {0, 0, sum(rotor[i].momentum for i in 1:4)};
  for i in 1:4 loop
    connect(rotor_speed_command[i], rotor[i].command) annotation(Line(points = {{-120, 50}, {-80, 50}, {-80, 16}, {-64, 16}}, color = {0, 0, 127}));
    rotor[i].air_velocity = air_velocity;
    rotor[i].rate = body.rate;
    rotor_speed[i] = rotor[i].speed;
  end for;
  body.force = {sum(rotor[i].force[j] for i in 1:4) for j in 1:3} - 0.5*air_density*sqrt(air_velocity*air_velocity)*(drag_area .* air_velocity);
  body.torque = {sum(rotor[i].torque[j] for i in 1:4) for j in 1:3} - cross(body.rate, momentum);
  specific_force = body.force/mass + cross(body.angular_acceleration, imu_position) + cross(body.rate, cross(body.rate, imu_position));
  connect(body.q, q) annotation(Line(points = {{62, 0}, {88, 0}, {88, 85}, {110, 85}}, color = {0, 0, 127}));
  connect(body.rate, rate) annotation(Line(points = {{62, -8}, {94, -8}, {94, 55}, {110, 55}}, color = {0, 0, 127}));
  connect(body.velocity, velocity) annotation(Line(points = {{62, 8}, {76, 8}, {76, -25}, {110, -25}}, color = {0, 0, 127}));
  connect(body.position, position) annotation(Line(points = {{62, 16}, {70, 16}, {70, -55}, {110, -55}}, color = {0, 0, 127}));
  annotation(
    Icon(graphics = {
      Line(points = {{-50, 50}, {50, -50}}, color = {80, 80, 80}, thickness = 1.0),
      Line(points = {{-50, -50}, {50, 50}}, color = {80, 80, 80}, thickness = 1.0),
      Ellipse(extent = {{-80, 80}, {-20, 20}}, lineColor = {0, 85, 150}, thickness = 0.8),
      Ellipse(extent = {{20, 80}, {80, 20}}, lineColor = {200, 90, 0}, thickness = 0.8),
      Ellipse(extent = {{-80, -20}, {-20, -80}}, lineColor = {0, 85, 150}, thickness = 0.8),
      Ellipse(extent = {{20, -20}, {80, -80}}, lineColor = {0, 85, 150}, thickness = 0.8),
      Rectangle(extent = {{-16, 16}, {16, -16}}, lineColor = {80, 80, 80}, fillColor = {225, 225, 225}, fillPattern = FillPattern.Solid)}),
    Documentation(info = "<html>
<p>A <a href=\"modelica://AHRS.Plants.RigidBody\">rigid body</a> carried by four <a href=\"modelica://AHRS.Plants.Rotor\">rotors</a> in X arrangement.
Rotors 1 (front right) and 2 (rear left) turn counter-clockwise seen from above, 3 (front left) and 4 (rear right) clockwise.</p>
<pre>
u = q* (v - wind) q                        velocity through the air
F = sum F_i - rho/2 |u| A .* u             body drag with area A per axis
M = sum M_i - w x h                        h: angular momentum of the rotors
f = F/m + w' x r + w x (w x r)             specific force at the IMU's place r
</pre>
<p>Inputs, outputs and parameters carry the names of the FMU <code>quadrotor</code>; the FMU has a ground plane besides.</p>
</html>"));
end Quadrotor;
