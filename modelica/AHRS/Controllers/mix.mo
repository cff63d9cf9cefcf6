within AHRS.Controllers;
function mix "Thrusts of four rotors for a total thrust and a moment, within limits"
  extends Icons.Function;
  input Real thrust(unit = "N") "Wanted total thrust";
  input Real torque[3](each unit = "N.m") "Wanted moment, body axes";
  input Real arm(unit = "m") "Front and right distance of the rotors";
  input Real torque_ratio(unit = "m") "Drag torque over thrust of a rotor";
  input Real thrust_min(unit = "N") "Least thrust of a rotor";
  input Real thrust_max(unit = "N") "Greatest thrust of a rotor";
  output Real y[7] "Four thrusts, collective per rotor, part of roll and pitch that fits, part of yaw that fits";
protected
  Real tilt[4] "Roll and pitch";
  Real turn[4] "Yaw";
  Real spread "Between the highest and the lowest rotor";
  Real tilt_factor "Part of roll and pitch that fits";
  Real turn_factor "Part of yaw that fits";
  Real collective "Common thrust";
  Real room "Thrust a rotor has left for yaw";
algorithm
  tilt := {-torque[1] + torque[2], torque[1] - torque[2], torque[1] + torque[2], -torque[1] - torque[2]}/(4*arm);
  turn := torque[3]/(4*torque_ratio)*{1.0, 1.0, -1.0, -1.0};
  spread := max(tilt) - min(tilt);
  tilt_factor := if spread > thrust_max - thrust_min then (thrust_max - thrust_min)/spread else 1.0;
  tilt := tilt_factor*tilt;
  collective := min(thrust_max - max(tilt), max(thrust_min - min(tilt), thrust/4));
  turn_factor := 1.0;
  for i in 1:4 loop
    room := max(0.0, if turn[i] > 0 then thrust_max - collective - tilt[i] else collective + tilt[i] - thrust_min);
    if abs(turn[i]) > room then
      turn_factor := min(turn_factor, room/abs(turn[i]));
    end if;
  end for;
  y := {collective + tilt[1] + turn_factor*turn[1], collective + tilt[2] + turn_factor*turn[2],
        collective + tilt[3] + turn_factor*turn[3], collective + tilt[4] + turn_factor*turn[4],
        collective, tilt_factor, turn_factor};
  annotation(Documentation(info = "<html>
<pre>
T_i = T_c + (-sgn(y_i) M_x + sgn(x_i) M_y)/(4 d) - s_i M_z/(4 kappa)
</pre>
<p>When this leaves the limits, roll and pitch come before the collective thrust and that before yaw: roll and pitch are scaled until their spread fits, the collective
is moved until they fit around it, yaw gets what is left.</p>
</html>"));
end mix;
