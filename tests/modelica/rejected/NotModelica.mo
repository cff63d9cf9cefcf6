model NotModelica "A statement of another language"
  Real x(start = 0);
equation
  x' = 1;
end NotModelica;
