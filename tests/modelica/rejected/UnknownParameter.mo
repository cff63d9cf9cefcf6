model UnknownParameter "A gain that the filter has not"
  AHRS.Filters.ComplementaryPair pair(kd = 1, angle = 0, rate = 0);
end UnknownParameter;
