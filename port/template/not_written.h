/* For what is still to be written: says which function that is, where, and what it should do, and ends the program. */
#ifndef MELLIN_NOT_WRITTEN_H
#define MELLIN_NOT_WRITTEN_H

#define NOT_WRITTEN(what) not_written(__FILE__, __LINE__, __func__, what)

void not_written(const char* file, unsigned line, const char* function, const char* what) __attribute__((noreturn));

#endif
