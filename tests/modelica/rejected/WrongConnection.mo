model WrongConnection "A number connected to a bus"
  AHRS.Plants.RigidBody body(force = zeros(3), torque = zeros(3));
  AHRS.Filters.SecondOrderGCF filter;
equation
  connect(body.q, filter.imu);
end WrongConnection;
