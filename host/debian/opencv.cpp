// Replacements for parts of OpenCV's static library, so that the packaged program needs no library
// that a bare Debian does not have. scripts/package removes the library's own.
//
// - LAPACK: OpenCV's core calls it for matrices of 25 rows or more. Otherwise, or where it is not
//   implemented, core computes the same itself (hal_internal.cpp). Plumb has no such matrix.
// - TBB: OpenCV's core divides loops over the rows of a picture among threads. Here the calling
//   thread runs them; Plumb's threads run the camera and the control loop.
// - OpenGL: core looks up its functions; Plumb draws nothing with it.

#include <cstddef>
#include <opencv2/core/utility.hpp>

namespace cv {

ParallelLoopBody::~ParallelLoopBody() {}

void parallel_for_(const Range &range, const ParallelLoopBody &body, double) {
  if (!range.empty()) {
    body(range);
  }
}

int getNumThreads() { return 1; }
void setNumThreads(int) {}
int getThreadNum() { return 0; }
int getNumberOfCPUs() { return 1; }
const char *currentParallelFramework() { return nullptr; }

} // namespace cv

// CV_HAL_ERROR_NOT_IMPLEMENTED of opencv2/core/hal/interface.h
static const int kNotImplemented = 1;

#define LAPACK(type, bits)                                                                         \
  int lapack_LU##bits(type *, size_t, int, type *, size_t, int, int *) { return kNotImplemented; } \
  int lapack_Cholesky##bits(type *, size_t, int, type *, size_t, int, bool *) {                    \
    return kNotImplemented;                                                                        \
  }                                                                                                \
  int lapack_SVD##bits(type *, size_t, type *, type *, size_t, type *, size_t, int, int, int) {    \
    return kNotImplemented;                                                                        \
  }                                                                                                \
  int lapack_QR##bits(type *, size_t, int, int, int, type *, size_t, type *, int *) {              \
    return kNotImplemented;                                                                        \
  }                                                                                                \
  int lapack_gemm##bits(const type *, size_t, const type *, size_t, type, const type *, size_t,    \
                        type, type *, size_t, int, int, int, int) {                                \
    return kNotImplemented;                                                                        \
  }                                                                                                \
  int lapack_gemm##bits##c(const type *, size_t, const type *, size_t, type, const type *, size_t, \
                           type, type *, size_t, int, int, int, int) {                             \
    return kNotImplemented;                                                                        \
  }

LAPACK(float, 32f)
LAPACK(double, 64f)

extern "C" void *glXGetProcAddressARB(const unsigned char *) { return nullptr; }
