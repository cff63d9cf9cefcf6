/* The two functions of a Modelica tool that the library calls, for tests without such a tool. */
#ifndef MODELICA_UTILITIES_H
#define MODELICA_UTILITIES_H

void ModelicaError(const char *text);
void ModelicaFormatError(const char *format, ...);

#endif
