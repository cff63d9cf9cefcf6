/* The core's corners, called by the main program of the C tests. */
#ifndef TEST_CORE_H
#define TEST_CORE_H

/* Prints the first failure and ends the process. */
void test_core(void);

#endif
