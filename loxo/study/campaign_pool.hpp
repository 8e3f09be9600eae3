// SPDX-License-Identifier: Apache-2.0
// Independent pieces of work on threads, for studies that are not campaigns with a store.
#pragma once
#include <cstddef>
#include <functional>

namespace loxo {

// f(0) … f(n - 1), each once, on `threads` threads (0: as many as there are; 1: on this one, in
// order). Results must go to places of their own: then they do not depend on the threads. What f
// throws is thrown here.
void run_parallel(std::size_t n, int threads, const std::function<void(std::size_t)>& f);

}  // namespace loxo
