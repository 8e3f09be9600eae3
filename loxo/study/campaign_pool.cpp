// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/campaign_pool.hpp"

#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

namespace loxo {

void run_parallel(std::size_t n, int threads, const std::function<void(std::size_t)>& f) {
  const int count = threads > 0 ? threads : oneapi::tbb::info::default_concurrency();
  if (count == 1) {
    for (std::size_t i = 0; i < n; ++i) f(i);
    return;
  }
  oneapi::tbb::task_arena arena(count);
  arena.execute([&] {
    oneapi::tbb::parallel_for(
        oneapi::tbb::blocked_range<std::size_t>(0, n, 1),
        [&](const oneapi::tbb::blocked_range<std::size_t>& r) {
          for (std::size_t i = r.begin(); i < r.end(); ++i) f(i);
        },
        oneapi::tbb::simple_partitioner());
  });
}

}  // namespace loxo
