/* Between a processor's reset code and the rest. */
#ifndef MELLIN_START_H
#define MELLIN_START_H

/* Never returns: ends with main()'s exit status. Requires a stack. */
void start(void) __attribute__((noreturn));

/* What a board does before anything else: clocks, external memory. Called on the stack, before variables have their
 * values: must not use any. A board need not define it. */
void board_initialise(void);

/* Ends the program with status 70, naming the processor's exception. */
void fault(const char* what) __attribute__((noreturn));

#endif
