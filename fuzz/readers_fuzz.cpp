// SPDX-License-Identifier: Apache-2.0
// Mutates the files of a corpus and gives them to the readers: CSV and the other tables of text,
// HDF5, .imr, drive.toml, quantities. A reader may refuse with loxo::Error and tell rows; anything
// else is a failure, and the input that made it is kept. The same seed makes the same inputs.
//   readers_fuzz --corpus fuzz/corpus --runs 1000000 --seed 7
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "loxo/log/drive.hpp"
#include "loxo/log/hdf5_file.hpp"
#include "loxo/log/table.hpp"
#include "loxo/num/error.hpp"
#include "loxo/text/quantity.hpp"
#include "loxo/text/toml.hpp"

namespace {

namespace fs = std::filesystem;

struct Input {
  std::string name, bytes;
};

void write(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}
std::string slurp(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

// A table of any format: all its columns, at most as many rows as a mutation can make.
void read_table(const std::string& path) {
  for (const auto& name : loxo::tables_of(path)) {
    const auto table = loxo::open_table(path, name);
    const auto words = table->word_columns();
    std::vector<std::string> numbers;
    for (const auto& c : table->header())
      if (std::find(words.begin(), words.end(), c) == words.end()) numbers.push_back(c);
    table->select(numbers);
    std::vector<double> row(numbers.size());
    loxo::Diagnostics d;
    for (int i = 0; i < 100000 && table->next(row, d); ++i) {
      for (const auto& w : words) static_cast<void>(table->word(w));
      static_cast<void>(table->where());
    }
  }
}

void read_drive(const std::string& folder) {
  const loxo::Drive drive = loxo::read_drive(folder);
  loxo::Diagnostics d;
  if (drive.imu.present) {
    loxo::ImuReader imu(drive, d);
    loxo::ImuIncrement<double> s;
    while (imu.next(s))
      if (!std::isfinite(s.t + s.dt + s.dv.x + s.dtheta.z)) throw std::logic_error("a NaN sample");
  }
  if (drive.odometer.present) loxo::read_odometer(drive, d);
  if (drive.track.present) loxo::read_track(drive, d);
  if (drive.fix.present) loxo::read_fixes(drive, d);
  if (drive.reference.present) loxo::read_reference(drive, d);
}

void read_quantities(const std::string& text) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    for (int k = 0; k <= static_cast<int>(loxo::Dimension::kLengthNoise); ++k) {
      const auto d = static_cast<loxo::Dimension>(k);
      try {
        if (!std::isfinite(loxo::parse_quantity(line, d, "fuzz")))
          throw std::logic_error("a quantity that is not finite: " + line);
      } catch (const loxo::Error&) {
      }
      try {
        loxo::parse_vector3(line, d, "fuzz");
      } catch (const loxo::Error&) {
      }
    }
    static_cast<void>(loxo::unit_of_column(line));
  }
}

class Mutator {
 public:
  explicit Mutator(unsigned long long seed) : random_(seed) {}
  std::size_t below(std::size_t n) { return n == 0 ? 0 : random_() % n; }
  std::string operator()(std::string s, const std::vector<Input>& corpus) {
    static const std::vector<std::string> words = {"nan",
                                                   "inf",
                                                   "-",
                                                   "1e309",
                                                   "1e-320",
                                                   "\"",
                                                   "\"\"",
                                                   ",",
                                                   ";",
                                                   "\r\n",
                                                   "\n\n",
                                                   "#",
                                                   "\t",
                                                   std::string(1, '\0'),
                                                   "\xEF\xBB\xBF",
                                                   "\xff",
                                                   "=",
                                                   "[",
                                                   "]]",
                                                   "{ a = 1 }",
                                                   "0x",
                                                   "99999999999999999999",
                                                   "deg/s",
                                                   "m/s^2",
                                                   "%",
                                                   "'",
                                                   "\\",
                                                   "<trkpt",
                                                   "/>",
                                                   "$GPGGA,",
                                                   "*",
                                                   "{\"type\":"};
    const std::size_t times = 1 + below(4);
    for (std::size_t i = 0; i < times; ++i) {
      const std::size_t at = below(s.size() + 1);
      switch (below(8)) {
        case 0:
          if (!s.empty()) s[below(s.size())] = static_cast<char>(random_());
          break;
        case 1:
          s.insert(at, words[below(words.size())]);
          break;
        case 2:
          s.erase(at, below(20));
          break;
        case 3:
          s.resize(at);
          break;
        case 4: {
          const std::string part = s.substr(at, below(60));
          s.insert(below(s.size() + 1), part);
          break;
        }
        case 5: {
          const std::string& other = corpus[below(corpus.size())].bytes;
          s.insert(at, other.substr(below(other.size() + 1), below(60)));
          break;
        }
        case 6:
          if (!s.empty()) s[below(s.size())] ^= static_cast<char>(1 << below(8));
          break;
        default:
          std::swap_ranges(s.begin(),
                           s.begin() + static_cast<std::ptrdiff_t>(std::min(at, s.size() - at)),
                           s.begin() + static_cast<std::ptrdiff_t>(std::max(at, s.size() - at)));
      }
    }
    return s;
  }

 private:
  std::mt19937_64 random_;
};

// Binary files of the corpus are made here, so that the tree holds text only.
std::vector<Input> made(const std::string& folder) {
  std::vector<Input> out;
  {
    loxo::H5Writer h5(folder + "/made.h5");
    h5.text("drive.toml", "[imu]\nfile = \"imu.csv\"\n");
    h5.begin("imu", {"t_s", "word", "gx"}, {"word"});
    h5.attribute("file", "imu.csv");
    for (int i = 0; i < 50; ++i) {
      const double x[] = {0.01 * i, 1e-5};
      const std::string_view w[] = {"geographic"};
      h5.row(x, w);
    }
    h5.commit();
  }
  out.push_back({"made.h5", slurp(folder + "/made.h5")});
  std::string imr(512 + 32 * 20, '\1');
  std::memcpy(imr.data(), "$IMURAW\0\0", 9);
  for (const auto& [at, x] :
       {std::pair<std::size_t, double>{25, 100.0}, {33, 1e-6}, {41, 1e-6}, {57, 0.0}})
    std::memcpy(&imr[at], &x, sizeof x);
  out.push_back({"made.imr", imr});
  return out;
}

}  // namespace

int main(int argc, char** argv) {
  std::string corpus_folder = "fuzz/corpus", keep = ".";
  unsigned long long runs = 4000, seed = 1;
  for (int i = 1; i < argc; ++i) {
    const std::string a = argv[i];
    const char* value = i + 1 < argc ? argv[i + 1] : nullptr;
    if (a == "--corpus" && value != nullptr) {
      corpus_folder = argv[++i];
    } else if (a == "--runs" && value != nullptr) {
      runs = std::strtoull(argv[++i], nullptr, 10);
    } else if (a == "--seed" && value != nullptr) {
      seed = std::strtoull(argv[++i], nullptr, 10);
    } else if (a == "--keep" && value != nullptr) {
      keep = argv[++i];
    } else {
      std::printf("readers_fuzz [--corpus FOLDER] [--runs N] [--seed N] [--keep FOLDER]\n");
      return a == "--help" ? 0 : 2;
    }
  }
  const std::string folder =
      (fs::temp_directory_path() / ("loxo_fuzz_" + std::to_string(::getpid()))).string();
  fs::create_directories(folder);
  std::vector<Input> corpus = made(folder);
  std::vector<fs::path> files;
  for (const auto& e : fs::directory_iterator(corpus_folder)) files.push_back(e.path());
  std::sort(files.begin(), files.end());
  for (const auto& f : files) corpus.push_back({f.filename().string(), slurp(f.string())});

  Mutator mutate(seed);
  unsigned long long refused = 0;
  int failed = 0;
  for (unsigned long long i = 0; i < runs && failed == 0; ++i) {
    const Input& from = corpus[i % corpus.size()];
    // The corpus itself first, as it is: it must be readable.
    const bool as_it_is = i < corpus.size();
    const std::string bytes = as_it_is ? from.bytes : mutate(from.bytes, corpus);
    const std::string path = folder + "/" + from.name;
    write(path, bytes);
    try {
      if (from.name == "drive.toml") {
        for (const Input& data : corpus)
          if (data.name.ends_with(".csv")) write(folder + "/" + data.name, data.bytes);
        read_drive(folder);
      } else if (from.name == "quantities.txt") {
        read_quantities(bytes);
      } else {
        read_table(path);
      }
    } catch (const loxo::Error& e) {
      ++refused;
      if (as_it_is) {
        std::printf("the corpus is refused: %s\n", e.what());
        failed = 1;
      }
    } catch (const std::exception& e) {
      const std::string kept =
          keep + "/fuzz-" + std::to_string(seed) + "-" + std::to_string(i) + "-" + from.name;
      write(kept, bytes);
      std::printf("run %llu: %s; the input is %s\n", i, e.what(), kept.c_str());
      failed = 1;
    }
  }
  std::printf("%llu inputs from %zu files, seed %llu: %llu refused\n", runs, corpus.size(), seed,
              refused);
  fs::remove_all(folder);
  return failed;
}
