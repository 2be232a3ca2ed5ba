// Serial ports for programs that QEMU runs for another architecture (qemu-user 7.2 answers ENOSYS to
// the termios2 requests, which set any baud rate). This library answers them by the older requests,
// without the rate: pseudo-terminals have none. scripts/package-check loads it into the bare system
// by /etc/ld.so.preload. Nothing of it is in the package.

#define _GNU_SOURCE
#include <asm/termbits.h>
#include <dlfcn.h>
#include <stdarg.h>
#include <string.h>

// Requests of include/uapi/asm-generic/ioctls.h.
enum { GET = 0x5401, SET = 0x5402 };
static const unsigned long kGet2 = 0x802c542a, kSet2 = 0x402c542b, kSetFlush2 = 0x402c542d;

typedef int Ioctl(int, unsigned long, ...);

// Both structures begin with the same fields; termios2 has the two rates after them.
static int get(Ioctl *next, int file, struct termios2 *settings) {
  struct termios old;
  int result = next(file, GET, &old);
  if (result == 0) {
    memset(settings, 0, sizeof *settings);
    memcpy(settings, &old, sizeof old);
    settings->c_ispeed = settings->c_ospeed = 115200;
  }
  return result;
}

static int set(Ioctl *next, int file, unsigned long request, const struct termios2 *settings) {
  struct termios old;
  memcpy(&old, settings, sizeof old);
  old.c_cflag = (old.c_cflag & ~CBAUD) | B115200;
  // TCSETS, TCSETSW and TCSETSF follow each other as their newer forms do.
  return next(file, SET + (request - kSet2), &old);
}

int ioctl(int file, unsigned long request, ...) {
  Ioctl *next = (Ioctl *)dlsym(RTLD_NEXT, "ioctl");
  va_list rest;
  va_start(rest, request);
  void *argument = va_arg(rest, void *);
  va_end(rest);
  if (request == kGet2) {
    return get(next, file, argument);
  }
  if (request >= kSet2 && request <= kSetFlush2) {
    return set(next, file, request, argument);
  }
  return next(file, request, argument);
}
