/* One run through the library. Every platform writes the same lines. */
#ifndef FIXTURE_H
#define FIXTURE_H

/* Writes text; each platform has its own. */
void platform_write(const char *text);

/* Instructions since the platform's start, or 0 where they are not counted. */
unsigned long platform_count(void);

/* Bytes of stack that were used since it was painted, or 0 where that is not known. */
void platform_paint_stack(void);
unsigned long platform_stack(void);

/* 0 if every call came to what it should. */
int fixture_run(void);

#endif
