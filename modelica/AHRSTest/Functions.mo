within AHRSTest;
model Functions "Quaternion algebra against its own inverses"
  extends AHRS.Icons.Example;
  import F = AHRS.Functions;
  Real euler[3] "Roll, pitch, yaw that wander over the sphere";
  Real q[4] "Their attitude";
  Real v[3] = {1, -2, 3} "Any vector";
  Real euler_again[3] "By way of the quaternion";
  Real rotated_by_product[4] "q v q* by two products";
  Real rotated[3] "By the matrix";
  Real back[3] "There and back";
  Real small[3] "Rotation vector of half the rotation, doubled";
  Real vector[3] "Rotation vector";
  Real tiny[3] "A rotation below the limit of the series, there and back";
  Real measured[4] "Attitude from ideal sensors";
  Real error[3] "Error of an estimate that is right";
  Real length "Length of q";
  Real field[3] "Field that the body sees";
  Real aligned[4] "q turned so that the field points north";
  Real smooth[4] "q with the sign of a reference";
equation
  euler = {3*sin(time), 1.5*sin(0.7*time), 3*cos(0.3*time)};
  q = F.fromEuler(euler);
  euler_again = F.toEuler(q);
  rotated_by_product = F.multiply(F.multiply(q, {0, v[1], v[2], v[3]}), F.conjugate(q));
  rotated = F.rotate(q, v);
  back = F.rotateBack(q, rotated);
  vector = F.toRotationVector(q);
  small = 2*F.toRotationVector(F.fromRotationVector(0.5*vector));
  tiny = F.toRotationVector(F.fromRotationVector(1e-7*v));
  measured = F.accelMagAttitude(F.rotateBack(q, {0, 0, -9.8}), F.rotateBack(q, {4e-5, 0, 3e-5}));
  error = F.attitudeError(q, F.rotateBack(q, {0, 0, -9.8}), F.rotateBack(q, {4e-5, 0, 3e-5}), true, true);
  field = F.rotateBack(q, {4e-5, 2e-5, 3e-5});
  aligned = F.alignHeading(q, field);
  smooth = F.continued(-q, q);
  length = sqrt(F.normalise(2*q)*F.normalise(3*q));
  annotation(experiment(StopTime = 20, Interval = 0.05, Tolerance = 1e-6),
    Documentation(info = "<html><p>Each result has a twin that must equal it.</p></html>"));
end Functions;
