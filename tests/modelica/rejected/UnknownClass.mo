model UnknownClass "A block that the library has not"
  AHRS.Filters.Madgwick filter;
end UnknownClass;
