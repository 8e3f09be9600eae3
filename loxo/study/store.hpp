// SPDX-License-Identifier: Apache-2.0
// The rows of a campaign on disk. While it runs, each process appends whole blocks of trials, each
// with its checksum, to a segment of its own under STORE.parts/; a torn or damaged block is as if
// it had never been computed. merge() makes one SQLite file of them, a row per trial, written aside
// and renamed.
#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace loxo {

struct StoreColumn {
  std::string name;
  bool parameter = false;  // else a metric
  std::string meaning;
};

// What makes two runs one campaign: the same rows for the same trial numbers.
struct StoreIdentity {
  std::string name, kind, config;  // config: kind, settings and distributions in canonical form
  std::string source;  // the campaign file's text, to read it again; not part of the identity
  std::vector<std::string> sets;  // --set key=value on top of it
  std::string version;            // of the program
  std::uint64_t seed = 0;
  std::uint64_t block = 0;  // trials a block
  std::vector<StoreColumn> columns;
  std::uint64_t hash() const;
};

// Rows of a block: per trial the columns in order, then the health bits as a number.
struct Block {
  std::uint64_t index = 0;
  std::vector<double> rows;
};

// One process's segment, created with its first block.
class SegmentWriter {
 public:
  SegmentWriter(std::string folder, const StoreIdentity& identity, int rank);
  ~SegmentWriter();
  SegmentWriter(const SegmentWriter&) = delete;
  SegmentWriter& operator=(const SegmentWriter&) = delete;
  // Throws Error(kWork) where the disk is full; the segment then ends with its last whole block.
  void append(const Block& block);
  void sync();

 private:
  std::string folder_, path_;
  std::uint64_t hash_;
  std::size_t width_;
  int rank_, file_ = -1;
  long long size_ = 0;
  double synced_ = 0;
};

// All segments of a folder; scan() reads what has come since the last time.
class SegmentReader {
 public:
  SegmentReader(std::string folder, const StoreIdentity& identity);
  // Calls `seen` for every whole block that is new (or longer than the one known).
  void scan(const std::function<void(const Block&)>& seen);
  // Trials held of a block, 0 if none.
  std::uint64_t held(std::uint64_t block) const;
  // A block's rows again.
  Block read(std::uint64_t block) const;
  std::size_t damaged() const { return damaged_; }

 private:
  struct Place {
    std::string path;
    long long offset;
    std::uint64_t count;
  };
  std::string folder_;
  std::uint64_t hash_;
  std::size_t width_;
  std::map<std::string, long long> read_to_;
  std::map<std::uint64_t, Place> places_;
  std::size_t damaged_ = 0;
};

std::string parts_folder(const std::string& store);
// STORE.parts/ with the campaign in it. Throws Error(kWork) where it cannot be written,
// Error(kInput) where it belongs to another campaign or program version.
void open_parts(const std::string& store, const StoreIdentity& identity);
void remove_parts(const std::string& store);
bool has_parts(const std::string& store);
// From STORE.parts/ or STORE; throws Error(kInput) where there is neither.
StoreIdentity read_identity(const std::string& store);

// Trials 0 … count - 1 in order into STORE. `rows` gives block after block.
void write_store(const std::string& store, const StoreIdentity& identity, std::uint64_t count,
                 const std::map<std::string, std::string>& notes,
                 const std::function<Block(std::uint64_t)>& rows);

// A finished store.
class Store {
 public:
  explicit Store(const std::string& path);
  ~Store();
  const StoreIdentity& identity() const;
  const std::map<std::string, std::string>& notes() const;
  std::uint64_t trials() const;
  // One column in trial order; every `stride`-th trial.
  std::vector<double> column(const std::string& name, std::uint64_t stride = 1) const;
  // Trials with a health bit set.
  std::uint64_t bad_trials() const;
  // Columns and health of a trial; throws Error(kInput) where it is not held.
  std::vector<double> row(std::uint64_t trial) const;
  Block block(std::uint64_t index) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace loxo
