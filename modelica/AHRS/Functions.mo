within AHRS;
package Functions "Quaternion algebra, measured attitude, filter errors and random numbers"
  extends Icons.Package;

  function multiply "Hamilton product of two quaternions"
    extends Icons.Function;
    input Real p[4] "Left factor";
    input Real q[4] "Right factor";
    output Real r[4] "p * q";
  algorithm
    r := {p[1]*q[1] - p[2]*q[2] - p[3]*q[3] - p[4]*q[4],
          p[1]*q[2] + p[2]*q[1] + p[3]*q[4] - p[4]*q[3],
          p[1]*q[3] - p[2]*q[4] + p[3]*q[1] + p[4]*q[2],
          p[1]*q[4] + p[2]*q[3] - p[3]*q[2] + p[4]*q[1]};
    annotation(Documentation(info = "<html><p><code>r = (p0 q0 - p.q, p0 q + q0 p + p x q)</code>. Attitudes chain from right to left: the product turns first by q, then by p.</p></html>"));
  end multiply;

  function conjugate "Inverse of a unit quaternion"
    extends Icons.Function;
    input Real q[4] "Quaternion";
    output Real r[4] "Conjugate";
  algorithm
    r := {q[1], -q[2], -q[3], -q[4]};
    annotation(Documentation(info = "<html><p><code>(q0, -q1, -q2, -q3)</code>: for a unit quaternion the rotation back.</p></html>"));
  end conjugate;

  function normalise "Scale to unit length"
    extends Icons.Function;
    input Real q[4] "Quaternion";
    output Real r[4] "Unit quaternion";
  algorithm
    r := q/sqrt(q*q);
    annotation(Documentation(info = "<html><p><code>q/|q|</code></p></html>"));
  end normalise;

  function fromRotationVector "Quaternion of a rotation vector"
    extends Icons.Function;
    input Real v[3](each unit = "rad") "Rotation vector";
    output Real q[4] "Quaternion";
  protected
    Real angle = sqrt(v*v) "Angle of rotation";
    Real factor "sin(angle/2)/angle";
  algorithm
    factor := if angle < 1e-4 then 0.5 - angle*angle/48 else sin(angle/2)/angle;
    q := {cos(angle/2), factor*v[1], factor*v[2], factor*v[3]};
    annotation(Documentation(info = "<html><p><code>q = (cos |v|/2, sin(|v|/2) v/|v|)</code>, by its series below 1e-4 rad.</p></html>"));
  end fromRotationVector;

  function toRotationVector "Shortest rotation vector of a quaternion"
    extends Icons.Function;
    input Real q[4] "Unit quaternion";
    output Real v[3](each unit = "rad") "Rotation vector, at most pi long";
  protected
    Real s = sqrt(q[2]^2 + q[3]^2 + q[4]^2) "Sine of half the angle";
    Real side = if q[1] < 0 then -1.0 else 1.0 "q and -q are the same attitude";
    Real factor "angle/s";
  algorithm
    factor := if s < 1e-6 then 2.0 + s*s/3 else 2*atan2(s, abs(q[1]))/s;
    v := side*factor*{q[2], q[3], q[4]};
    annotation(Documentation(info = "<html><p><code>v = 2 atan2(|q_v|, |q0|) q_v/|q_v|</code>, with the sign of q0.</p></html>"));
  end toRotationVector;

  function shortest "The one of q and -q with a scalar part that is not negative"
    extends Icons.Function;
    input Real q[4] "Quaternion";
    output Real r[4] "Same attitude";
  algorithm
    r := if q[1] < 0 then -q else q;
    annotation(Documentation(info = "<html><p>Both signs are the same attitude; this one is on the short way from zero.</p></html>"));
  end shortest;

  function limit "Each element within plus and minus its limit"
    extends Icons.Function;
    input Real x[3] "Values";
    input Real bound[3] "Limits";
    output Real y[3] "Limited values";
  algorithm
    for i in 1:3 loop
      y[i] := min(bound[i], max(-bound[i], x[i]));
    end for;
    annotation(Documentation(info = "<html><p><code>y_i = min(bound_i, max(-bound_i, x_i))</code></p></html>"));
  end limit;

  function toMatrix "Matrix that turns body vectors into navigation vectors"
    extends Icons.Function;
    input Real q[4] "Unit quaternion";
    output Real C[3, 3] "Rotation matrix; its columns are the body axes in navigation axes";
  algorithm
    C := {{q[1]^2 + q[2]^2 - q[3]^2 - q[4]^2, 2*(q[2]*q[3] - q[1]*q[4]), 2*(q[2]*q[4] + q[1]*q[3])},
          {2*(q[2]*q[3] + q[1]*q[4]), q[1]^2 - q[2]^2 + q[3]^2 - q[4]^2, 2*(q[3]*q[4] - q[1]*q[2])},
          {2*(q[2]*q[4] - q[1]*q[3]), 2*(q[3]*q[4] + q[1]*q[2]), q[1]^2 - q[2]^2 - q[3]^2 + q[4]^2}};
    annotation(Documentation(info = "<html><p><code>v_n = C v_b</code>, the same rotation as <code>q v_b q*</code>.</p></html>"));
  end toMatrix;

  function rotate "Body vector in navigation axes"
    extends Icons.Function;
    input Real q[4] "Unit quaternion";
    input Real v[3] "Vector in body axes";
    output Real r[3] "Vector in navigation axes";
  algorithm
    r := toMatrix(q)*v;
    annotation(Documentation(info = "<html><p><code>r = q v q*</code></p></html>"));
  end rotate;

  function rotateBack "Navigation vector in body axes"
    extends Icons.Function;
    input Real q[4] "Unit quaternion";
    input Real v[3] "Vector in navigation axes";
    output Real r[3] "Vector in body axes";
  algorithm
    r := toMatrix(conjugate(q))*v;
    annotation(Documentation(info = "<html><p><code>r = q* v q</code></p></html>"));
  end rotateBack;

  function derivative "Rate of change of an attitude"
    extends Icons.Function;
    input Real q[4] "Unit quaternion";
    input Real w[3](each unit = "rad/s") "Angular rate, body axes";
    output Real dq[4](each unit = "1/s") "Derivative";
  algorithm
    dq := 0.5*multiply(q, {0.0, w[1], w[2], w[3]}) + (1 - q*q)*q;
    annotation(Documentation(info = "<html><p><code>q' = 1/2 q * (0, w)</code>, plus a term that pulls the length back to one and vanishes there.</p></html>"));
  end derivative;

  function toEuler "Roll, pitch, yaw of an attitude"
    extends Icons.Function;
    input Real q[4] "Unit quaternion";
    output Real euler[3](each unit = "rad") "Roll, pitch, yaw";
  protected
    Real sine = 2*(q[1]*q[3] - q[2]*q[4]) "Sine of pitch";
  algorithm
    euler := {atan2(2*(q[1]*q[2] + q[3]*q[4]), q[1]^2 - q[2]^2 - q[3]^2 + q[4]^2),
              asin(min(1.0, max(-1.0, sine))),
              atan2(2*(q[2]*q[3] + q[1]*q[4]), q[1]^2 + q[2]^2 - q[3]^2 - q[4]^2)};
    annotation(Documentation(info = "<html><p>The order is yaw, pitch, roll (z-y-x). At a pitch of 90 degrees roll and yaw are not separate angles any more.</p></html>"));
  end toEuler;

  function fromEuler "Attitude of roll, pitch, yaw"
    extends Icons.Function;
    input Real euler[3](each unit = "rad") "Roll, pitch, yaw";
    output Real q[4] "Unit quaternion";
  algorithm
    q := multiply({cos(euler[3]/2), 0.0, 0.0, sin(euler[3]/2)},
                  multiply({cos(euler[2]/2), 0.0, sin(euler[2]/2), 0.0}, {cos(euler[1]/2), sin(euler[1]/2), 0.0, 0.0}));
    annotation(Documentation(info = "<html><p>Product of the three elementary rotations yaw, pitch, roll.</p></html>"));
  end fromEuler;

  function bodyRate "Angular rate of changing Euler angles"
    extends Icons.Function;
    input Real euler[3](each unit = "rad") "Roll, pitch, yaw";
    input Real change[3](each unit = "rad/s") "Their derivatives";
    output Real w[3](each unit = "rad/s") "Angular rate, body axes";
  algorithm
    w := {change[1] - sin(euler[2])*change[3],
          cos(euler[1])*change[2] + sin(euler[1])*cos(euler[2])*change[3],
          -sin(euler[1])*change[2] + cos(euler[1])*cos(euler[2])*change[3]};
    annotation(Documentation(info = "<html><p>Each angle turns about its own axis: yaw about down, pitch about the levelled right axis, roll about front.</p></html>"));
  end bodyRate;

  function accelMagAttitude "Attitude from specific force and magnetic field alone"
    extends Icons.Function;
    input Real f[3](each unit = "m/s2") "Specific force, body axes";
    input Real m[3](each unit = "T") "Magnetic flux density, body axes";
    output Real q[4] "Attitude, yaw from magnetic north";
  protected
    Real roll = atan2(-f[2], -f[3]);
    Real pitch = atan2(f[1], sqrt(f[2]^2 + f[3]^2));
    Real forward "Field along the levelled front axis";
    Real right "Field along the levelled right axis";
  algorithm
    forward := m[1]*cos(pitch) + m[2]*sin(roll)*sin(pitch) + m[3]*cos(roll)*sin(pitch);
    right := m[2]*cos(roll) - m[3]*sin(roll);
    q := fromEuler({roll, pitch, atan2(-right, forward)});
    annotation(Documentation(info = "<html><p>Roll and pitch bring the measured specific force to <code>(0, 0, -g)</code>, yaw then brings the horizontal field to north. Exact in every attitude when the vehicle does not accelerate.</p></html>"));
  end accelMagAttitude;

  function alignHeading "Turn an attitude about the vertical so that the measured field points north"
    extends Icons.Function;
    input Real q[4] "Attitude with an arbitrary heading";
    input Real m[3](each unit = "T") "Magnetic flux density, body axes";
    output Real r[4] "Attitude with the heading of the field";
  protected
    Real n[3] = rotate(q, m) "Field in the axes of q";
  algorithm
    r := multiply(fromRotationVector({0.0, 0.0, -atan2(n[2], n[1])}), q);
    annotation(Documentation(info = "<html><p>For the first usable magnetometer sample of a filter that had to begin without one.</p></html>"));
  end alignHeading;

  function continued "The one of q and -q that is nearer to a reference"
    extends Icons.Function;
    input Real q[4] "Quaternion";
    input Real reference[4] "Quaternion before";
    output Real r[4] "Same attitude without a jump of sign";
  algorithm
    r := if q*reference < 0 then -q else q;
    annotation(Documentation(info = "<html><p>Keeps the elements of a sampled attitude smooth.</p></html>"));
  end continued;

  function gravityError "Rotation that brings the estimated vertical to the measured one"
    extends Icons.Function;
    input Real q[4] "Estimated attitude";
    input Real f[3](each unit = "m/s2") "Specific force, body axes";
    output Real e[3](each unit = "rad") "Error, body axes";
  protected
    Real length = sqrt(f*f);
  algorithm
    e := if length > 0.980665 then cross(f/length, rotateBack(q, {0.0, 0.0, -1.0})) else zeros(3);
    annotation(Documentation(info = "<html><p><code>e = f/|f| x C'(0, 0, -1)</code>: no rotation about the vertical, and none at all below a tenth of g.</p></html>"));
  end gravityError;

  function headingError "Rotation about the vertical that brings the measured field to north"
    extends Icons.Function;
    input Real q[4] "Estimated attitude";
    input Real m[3](each unit = "T") "Magnetic flux density, body axes";
    output Real e[3](each unit = "rad") "Error, body axes";
  protected
    Real n[3] = rotate(q, m) "Field in estimated navigation axes";
    Real length = sqrt(n[1]^2 + n[2]^2) "Horizontal field";
  algorithm
    e := if length > 1e-9 then rotateBack(q, {0.0, 0.0, -n[2]/length}) else zeros(3);
    annotation(Documentation(info = "<html><p><code>e = C'(0, 0, -h_E/|h|)</code> with h the horizontal part of the field in estimated navigation axes. The sum of this and <a href=\"modelica://AHRS.Functions.gravityError\">gravityError</a>
has the same gain on all three axes: the error is decoupled.</p></html>"));
  end headingError;

  function attitudeError "Rotation from an estimated to the measured attitude, with equal gain on all axes"
    extends Icons.Function;
    input Real q[4] "Estimated attitude";
    input Real f[3](each unit = "m/s2") "Specific force, body axes";
    input Real m[3](each unit = "T") "Magnetic flux density, body axes";
    input Boolean use_f "The specific force may be used";
    input Boolean use_m "The magnetic flux density may be used";
    output Real e[3](each unit = "rad") "Error, body axes";
  algorithm
    e := (if use_f then gravityError(q, f) else zeros(3)) + (if use_m then headingError(q, m) else zeros(3));
    annotation(Documentation(info = "<html><p>Sum of <a href=\"modelica://AHRS.Functions.gravityError\">gravityError</a> and <a href=\"modelica://AHRS.Functions.headingError\">headingError</a>,
each only when its sensor may be used.</p></html>"));
  end attitudeError;

  function randomNumbers "Standard normal numbers and the generator's next state"
    extends Icons.Function;
    input Real state[2] "State of the generator: two whole numbers";
    input Integer n "How many numbers";
    output Real y[n + 2] "n normal numbers, then the next state";
  protected
    Real s[2];
    Real u[2] "Uniform numbers in (0, 1)";
  algorithm
    s := state;
    for i in 1:n loop
      for k in 1:2 loop
        s := {mod(40014.0*s[1], 2147483563.0), mod(40692.0*s[2], 2147483399.0)};
        u[k] := (mod(s[1] - s[2], 2147483562.0) + 0.5)/2147483562.0;
      end for;
      y[i] := sqrt(-2*log(u[1]))*cos(6.283185307179586*u[2]);
    end for;
    y[n + 1] := s[1];
    y[n + 2] := s[2];
    annotation(Documentation(info = "<html><p>Two multiplicative congruential generators combined (L'Ecuyer, 1988, period about 2e18), then Box and Muller's transform.
All products stay below 2^53, so the numbers are the same in every tool that computes in IEEE double precision.</p></html>"));
  end randomNumbers;

  function randomState "First state of the generator for a seed"
    extends Icons.Function;
    input Integer seed "Any whole number of at most nine digits";
    output Real state[2] "State of the generator";
  algorithm
    state := {1 + mod(16807.0*abs(seed) + 12345, 2147483562.0), 1 + mod(48271.0*abs(seed) + 67890, 2147483398.0)};
    for i in 1:10 loop
      state := {mod(40014.0*state[1], 2147483563.0), mod(40692.0*state[2], 2147483399.0)};
    end for;
    annotation(Documentation(info = "<html><p>Spreads the seed over both generators and runs them ten times, so that neighbouring seeds give unlike sequences.</p></html>"));
  end randomState;
  annotation(Icon(graphics = {Text(extent = {{-80, 60}, {80, -60}}, textColor = {108, 88, 49}, textString = "q v q*")}),
    Documentation(info = "<html><p>Quaternions are Hamilton's, scalar first, and turn body vectors into navigation vectors: <code>v_n = q v_b q*</code>.</p></html>"));
end Functions;
