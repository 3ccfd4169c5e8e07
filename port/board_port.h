/* The mellin_port of a board: what firmware hands to the library there. Each board's folder implements it; the
 * conformance test of port/conformance checks it. */
#ifndef MELLIN_BOARD_PORT_H
#define MELLIN_BOARD_PORT_H

#include "mellin/port.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Prepares the devices at its first call and returns the port; its contexts live as long as the program. */
mellin_port board_port(void);

#ifdef __cplusplus
}
#endif

#endif
