// SPDX-License-Identifier: Apache-2.0
// The door of MPI. It is entered only under mpirun or srun: a process alone pays nothing for it.
#include <algorithm>
#include <cstdlib>
#include <vector>

#include "loxo/num/error.hpp"
#include "loxo/study/campaign.hpp"

#ifdef LOXO_HAS_MPI
#include <mpi.h>
#endif

namespace loxo {
namespace {

// Set by Open MPI's and MPICH's launchers and by srun.
int launched_size() {
  for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS"})
    if (const char* s = std::getenv(name)) return std::max(1, std::atoi(s));
  return 1;
}

}  // namespace

#ifdef LOXO_HAS_MPI
bool Ranks::built_in() { return true; }

Ranks::Ranks() {
  if (launched_size() == 1) return;
  int provided = 0, ready = 0;
  MPI_Initialized(&ready);
  if (ready == 0) {
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided);
    mine_ = true;
  }
  MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
  MPI_Comm_size(MPI_COMM_WORLD, &size_);
  if (size_ != launched_size())
    throw Error(ErrorKind::kWork, "the launcher started " + std::to_string(launched_size()) +
                                      " processes, but they do not see each other as ranks "
                                      "(another MPI than this program's?)");
}
Ranks::~Ranks() {
  if (mine_) MPI_Finalize();
}
bool Ranks::all_equal(std::uint64_t x) const {
  if (size_ == 1) return true;
  unsigned long long v[2] = {x, ~x}, most[2];
  MPI_Allreduce(v, most, 2, MPI_UNSIGNED_LONG_LONG, MPI_MAX, MPI_COMM_WORLD);
  return most[0] == ~most[1];
}
int Ranks::largest(int x) const {
  if (size_ == 1) return x;
  int y = x;
  MPI_Allreduce(&x, &y, 1, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
  return y;
}
double Ranks::sum(double x) const {
  if (size_ == 1) return x;
  double y = x;
  MPI_Allreduce(&x, &y, 1, MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
  return y;
}
void Ranks::share(std::vector<std::uint64_t>& list) const {
  if (size_ == 1) return;
  unsigned long long n = list.size();
  MPI_Bcast(&n, 1, MPI_UNSIGNED_LONG_LONG, 0, MPI_COMM_WORLD);
  list.resize(n);
  // A count of MPI is an int.
  constexpr std::size_t kPiece = std::size_t{1} << 28;
  for (std::size_t i = 0; i < list.size(); i += kPiece)
    MPI_Bcast(list.data() + i, static_cast<int>(std::min(kPiece, list.size() - i)), MPI_UINT64_T, 0,
              MPI_COMM_WORLD);
}
#else
bool Ranks::built_in() { return false; }

Ranks::Ranks() {
  if (launched_size() > 1)
    throw Error(ErrorKind::kUsage,
                "this program was built without MPI: start it once a machine, with --threads");
}
Ranks::~Ranks() = default;
bool Ranks::all_equal(std::uint64_t) const { return true; }
int Ranks::largest(int x) const { return x; }
double Ranks::sum(double x) const { return x; }
void Ranks::share(std::vector<std::uint64_t>&) const {}
#endif

}  // namespace loxo
