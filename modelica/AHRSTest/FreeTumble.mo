within AHRSTest;
model FreeTumble "Rigid body without force or moment"
  extends AHRS.Icons.Example;
  AHRS.Plants.RigidBody body(gravity = 0, initial_rate = {3, 0.1, 2}, initial_velocity = {1, 2, 3}) annotation(Placement(transformation(extent = {{-20, -20}, {20, 20}})));
  AHRS.Types.AngularMomentum momentum[3] "Angular momentum, navigation axes";
  Real energy(unit = "J") "Kinetic energy of the rotation";
equation
  body.force = zeros(3);
  body.torque = zeros(3);
  momentum = AHRS.Functions.rotate(body.q, body.inertia .* body.rate);
  energy = 0.5*body.rate*(body.inertia .* body.rate);
  annotation(experiment(StopTime = 10, Interval = 0.05, Tolerance = 1e-10),
    Documentation(info = "<html><p><code>momentum</code> and <code>energy</code> stay what they were.</p></html>"));
end FreeTumble;
