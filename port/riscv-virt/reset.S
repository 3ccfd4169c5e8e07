/* Reset and exceptions of a RISC-V hart in machine mode. */
  .section .text.reset, "ax"
  .globl __reset
  .type __reset, @function
__reset:
  .option push
  .option norelax
  la gp, __global_pointer$
  .option pop
  la sp, __stack_top
  la t0, trap
  csrw mtvec, t0
  li t0, 0x2000 /* mstatus.FS: the floating-point unit, switched on, its state initial */
  csrs mstatus, t0
  csrw fcsr, zero
  tail start

  .balign 4
trap:
  la a0, trap_text
  tail fault

  .section .rodata
trap_text:
  .asciz "trap"
