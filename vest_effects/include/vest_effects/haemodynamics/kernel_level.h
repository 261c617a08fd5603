#pragma once

namespace vest::haemodynamics {

/// Which instruction level the inner loops run at: "baseline" or "avx2". Chosen once by the processor; the
/// environment variable VEST_KERNEL=baseline forces the former. Both give the same bits.
const char* kernelLevel();

}  // namespace vest::haemodynamics
