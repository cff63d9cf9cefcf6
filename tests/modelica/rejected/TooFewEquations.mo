model TooFewEquations "The wind is not given"
  AHRS.Plants.Quadrotor quadrotor(rotor_speed_command = fill(434, 4));
  Real unknown;
end TooFewEquations;
