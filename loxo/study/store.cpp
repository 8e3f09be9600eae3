// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/store.hpp"

#include <fcntl.h>
#include <sqlite3.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <unistd.h>

#include <bit>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>

#include "loxo/num/error.hpp"
#include "loxo/text/json.hpp"

namespace loxo {
namespace fs = std::filesystem;
namespace {

constexpr std::uint64_t kFileMagic = 0x314745534f584f4c;   // "LOXOSEG1"
constexpr std::uint64_t kBlockMagic = 0x314b4c424f584f4c;  // "LOXOBLK1"
constexpr std::size_t kHead = 3;  // words before a file's or a block's content

// FNV-1a over words, mixed downward: any change of a word changes it.
std::uint64_t checksum(const std::uint64_t* w, std::size_t n) {
  std::uint64_t h = 0xcbf29ce484222325;
  for (std::size_t i = 0; i < n; ++i) {
    h = (h ^ w[i]) * 0x100000001b3;
    h ^= h >> 29;
  }
  return h;
}
void add(std::uint64_t& h, const std::string& s) {
  for (const char c : s) h = (h ^ static_cast<unsigned char>(c)) * 0x100000001b3;
  h = (h ^ 0xff) * 0x100000001b3;
}
double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}
[[noreturn]] void cannot_write(const std::string& path, int error) {
  const bool full = error == ENOSPC || error == EDQUOT || error == EFBIG;
  throw Error(
      ErrorKind::kWork,
      (full ? std::string("disk full") : std::string("cannot write: ") + std::strerror(error)) +
          "; what was computed before is safe, the same command resumes",
      path);
}

Json identity_json(const StoreIdentity& id) {
  Json columns = Json::array();
  for (const auto& c : id.columns)
    columns.push_back(
        {{"name", c.name}, {"role", c.parameter ? "parameter" : "metric"}, {"meaning", c.meaning}});
  return {{"name", id.name},     {"kind", id.kind},   {"version", id.version},
          {"seed", id.seed},     {"block", id.block}, {"config", id.config},
          {"source", id.source}, {"sets", id.sets},   {"columns", columns}};
}
StoreIdentity identity_from(const Json& j) {
  StoreIdentity id;
  id.name = j.at("name"), id.kind = j.at("kind"), id.version = j.at("version");
  id.seed = j.at("seed"), id.block = j.at("block"), id.config = j.at("config");
  id.source = j.at("source"), id.sets = j.at("sets").get<std::vector<std::string>>();
  for (const auto& c : j.at("columns"))
    id.columns.push_back({c.at("name"), c.at("role") == "parameter", c.at("meaning")});
  return id;
}

void write_all(int file, const std::string& path, const void* data, std::size_t size) {
  const char* p = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t n = ::write(file, p, size);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) cannot_write(path, n < 0 ? errno : ENOSPC);
    p += n;
    size -= static_cast<std::size_t>(n);
  }
}

struct Descriptor {
  int file;
  explicit Descriptor(int f) : file(f) {}
  ~Descriptor() {
    if (file >= 0) ::close(file);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
};
bool read_words(int file, long long offset, std::vector<std::uint64_t>& words) {
  char* p = reinterpret_cast<char*>(words.data());
  std::size_t left = words.size() * 8;
  while (left > 0) {
    const ssize_t n = ::pread(file, p, left, offset);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    p += n, offset += n, left -= static_cast<std::size_t>(n);
  }
  return true;
}

}  // namespace

std::uint64_t StoreIdentity::hash() const {
  std::uint64_t h = 0xcbf29ce484222325;
  for (const auto& s : {kind, config, version, std::to_string(seed), std::to_string(block)})
    add(h, s);
  for (const auto& c : columns) add(h, c.name);
  return h;
}

// ---- segments
// --------------------------------------------------------------------------------------------
SegmentWriter::SegmentWriter(std::string folder, const StoreIdentity& identity, int rank)
    : folder_(std::move(folder)),
      hash_(identity.hash()),
      width_(identity.columns.size() + 1),
      rank_(rank) {}

SegmentWriter::~SegmentWriter() {
  if (file_ >= 0) ::close(file_);
}

void SegmentWriter::append(const Block& block) {
  if (file_ < 0) {
    // A name that no other process has: process number, rank, and a free number for restarts.
    char host[64] = "host";
    ::gethostname(host, sizeof host - 1);
    for (int i = 0; file_ < 0; ++i) {
      path_ = folder_ + "/" + host + "-" + std::to_string(rank_) + "-" +
              std::to_string(::getpid()) + "-" + std::to_string(i) + ".seg";
      file_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC, 0644);
      if (file_ < 0 && errno != EEXIST) cannot_write(path_, errno);
    }
    const std::uint64_t head[kHead] = {kFileMagic, hash_, width_};
    write_all(file_, path_, head, sizeof head);
    size_ = sizeof head;
    synced_ = now();
  }
  const std::size_t n = block.rows.size();
  std::vector<std::uint64_t> words(kHead + n + 1);
  words[0] = kBlockMagic;
  words[1] = block.index;
  words[2] = n / width_;
  for (std::size_t i = 0; i < n; ++i)
    words[kHead + i] = std::bit_cast<std::uint64_t>(block.rows[i]);
  words.back() = checksum(words.data(), kHead + n);
  try {
    write_all(file_, path_, words.data(), words.size() * 8);
  } catch (...) {
    // Back to the last whole block; should that fail too, readers drop the torn one by its
    // checksum.
    if (::ftruncate(file_, size_) != 0) errno = 0;
    throw;
  }
  size_ += static_cast<long long>(words.size() * 8);
  if (now() - synced_ > 1.0) sync();
}

void SegmentWriter::sync() {
  if (file_ >= 0 && ::fdatasync(file_) != 0 && (errno == ENOSPC || errno == EDQUOT || errno == EIO))
    cannot_write(path_, errno);
  synced_ = now();
}

SegmentReader::SegmentReader(std::string folder, const StoreIdentity& identity)
    : folder_(std::move(folder)), hash_(identity.hash()), width_(identity.columns.size() + 1) {}

void SegmentReader::scan(const std::function<void(const Block&)>& seen) {
  std::error_code ec;
  for (const auto& entry : fs::directory_iterator(folder_, ec)) {
    if (entry.path().extension() != ".seg") continue;
    const std::string path = entry.path().string();
    auto& offset = read_to_[path];
    if (offset < 0) continue;  // not ours
    std::error_code size_ec;
    const auto size = static_cast<long long>(fs::file_size(path, size_ec));
    if (size_ec || size <= offset) continue;
    Descriptor d(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
    if (d.file < 0) continue;
    std::vector<std::uint64_t> head(kHead);
    if (offset == 0) {
      if (!read_words(d.file, 0, head)) continue;
      if (head[0] != kFileMagic || head[1] != hash_ || head[2] != width_) {
        offset = -1;
        ++damaged_;
        continue;
      }
      offset = kHead * 8;
    }
    while (offset + static_cast<long long>((kHead + 1) * 8) <= size) {
      if (!read_words(d.file, offset, head)) break;
      const auto room = static_cast<std::uint64_t>(size - offset) / 8;
      // A torn end: wait for the rest, which may never come.
      if (head[0] != kBlockMagic || head[2] == 0 || head[2] > room / width_ ||
          kHead + head[2] * width_ + 1 > room)
        break;
      std::vector<std::uint64_t> words(kHead + head[2] * width_ + 1);
      if (!read_words(d.file, offset, words)) break;
      if (checksum(words.data(), words.size() - 1) != words.back()) break;
      if (head[2] > held(head[1])) {
        places_[head[1]] = {path, offset, head[2]};
        Block b;
        b.index = head[1];
        for (std::size_t i = kHead; i + 1 < words.size(); ++i)
          b.rows.push_back(std::bit_cast<double>(words[i]));
        seen(b);
      }
      offset += static_cast<long long>(words.size() * 8);
    }
  }
}

std::uint64_t SegmentReader::held(std::uint64_t block) const {
  const auto it = places_.find(block);
  return it == places_.end() ? 0 : it->second.count;
}

Block SegmentReader::read(std::uint64_t block) const {
  const Place& p = places_.at(block);
  Descriptor d(::open(p.path.c_str(), O_RDONLY | O_CLOEXEC));
  std::vector<std::uint64_t> words(kHead + p.count * width_ + 1);
  if (d.file < 0 || !read_words(d.file, p.offset, words) ||
      checksum(words.data(), words.size() - 1) != words.back())
    throw Error(ErrorKind::kWork, "block " + std::to_string(block) + " changed while it was read",
                p.path);
  Block b;
  b.index = block;
  for (std::size_t i = kHead; i + 1 < words.size(); ++i)
    b.rows.push_back(std::bit_cast<double>(words[i]));
  return b;
}

// ---- the folder of parts
// ---------------------------------------------------------------------------------
std::string parts_folder(const std::string& store) { return store + ".parts"; }
bool has_parts(const std::string& store) {
  return fs::exists(parts_folder(store) + "/campaign.json");
}

static void check_same(const StoreIdentity& held, const StoreIdentity& wanted,
                       const std::string& where) {
  if (held.version != wanted.version)
    throw Error(ErrorKind::kInput,
                "the store was begun by program version " + held.version + ", this is " +
                    wanted.version + "; finish it with that version or choose another store",
                where);
  if (held.hash() == wanted.hash()) return;
  std::string what = "the store holds another campaign: '" + held.name + "'";
  if (held.kind != wanted.kind)
    what += " of kind " + held.kind + ", found " + wanted.kind;
  else if (held.seed != wanted.seed)
    what +=
        " with seed " + std::to_string(held.seed) + ", found seed " + std::to_string(wanted.seed);
  else if (held.block != wanted.block)
    what +=
        " with blocks of " + std::to_string(held.block) + ", found " + std::to_string(wanted.block);
  else
    what += " with other parameters or settings";
  throw Error(ErrorKind::kInput, what + "; choose another store", where);
}

void open_parts(const std::string& store, const StoreIdentity& identity) {
  const std::string folder = parts_folder(store), file = folder + "/campaign.json";
  if (fs::exists(store)) check_same(Store(store).identity(), identity, store);
  if (has_parts(store)) {
    check_same(read_identity(store), identity, folder);
    if (::access(folder.c_str(), W_OK) != 0) cannot_write(folder, errno);
    return;
  }
  std::error_code ec;
  const fs::path parent = fs::path(store).parent_path();
  if (!parent.empty() && !fs::exists(parent))
    throw Error(ErrorKind::kWork, "no folder '" + parent.string() + "' to write the store into",
                store);
  fs::create_directory(folder, ec);
  if (ec) throw Error(ErrorKind::kWork, "store not writable: " + ec.message(), folder);
  const std::string aside = file + "." + std::to_string(::getpid());
  Descriptor d(::open(aside.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
  if (d.file < 0)
    throw Error(ErrorKind::kWork, std::string("store not writable: ") + std::strerror(errno),
                folder);
  const std::string text = dump_json(identity_json(identity)) + "\n";
  write_all(d.file, aside, text.data(), text.size());
  if (::fsync(d.file) != 0 || ::rename(aside.c_str(), file.c_str()) != 0) cannot_write(file, errno);
}

void remove_parts(const std::string& store) {
  std::error_code ec;
  // The campaign last: a folder without it is no store, one with it can be resumed.
  for (const auto& entry : fs::directory_iterator(parts_folder(store), ec))
    if (entry.path().extension() == ".seg") fs::remove(entry.path(), ec);
  fs::remove_all(parts_folder(store), ec);
}

StoreIdentity read_identity(const std::string& store) {
  if (has_parts(store)) {
    const std::string file = parts_folder(store) + "/campaign.json";
    try {
      return identity_from(read_json(file));
    } catch (const nlohmann::json::exception& e) {
      throw Error(ErrorKind::kInput, std::string("not the description of a campaign: ") + e.what(),
                  file);
    }
  }
  return Store(store).identity();
}

// ---- SQLite
// ----------------------------------------------------------------------------------------------
namespace {

struct Database {
  sqlite3* db = nullptr;
  std::string path;
  Database(const std::string& p, int flags) : path(p) {
    if (sqlite3_open_v2(p.c_str(), &db, flags, nullptr) != SQLITE_OK) fail();
  }
  ~Database() { sqlite3_close(db); }
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;
  [[noreturn]] void fail() const {
    const int code = db != nullptr ? sqlite3_errcode(db) : SQLITE_NOMEM;
    const std::string message = db != nullptr ? sqlite3_errmsg(db) : "out of memory";
    if (code == SQLITE_FULL || code == SQLITE_IOERR) cannot_write(path, ENOSPC);
    if (code == SQLITE_NOTADB || code == SQLITE_CORRUPT || code == SQLITE_ERROR)
      throw Error(ErrorKind::kInput, "not a campaign store: " + message, path);
    throw Error(ErrorKind::kWork, message, path);
  }
  void run(const std::string& sql) const {
    if (sqlite3_exec(db, sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK) fail();
  }
};
struct Statement {
  const Database& database;
  sqlite3_stmt* s = nullptr;
  Statement(const Database& d, const std::string& sql) : database(d) {
    if (sqlite3_prepare_v2(d.db, sql.c_str(), -1, &s, nullptr) != SQLITE_OK) d.fail();
  }
  ~Statement() { sqlite3_finalize(s); }
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;
  bool step() {
    const int r = sqlite3_step(s);
    if (r != SQLITE_ROW && r != SQLITE_DONE) database.fail();
    return r == SQLITE_ROW;
  }
  void reset() { sqlite3_reset(s); }
  void text(int i, const std::string& t) {
    sqlite3_bind_text(s, i, t.data(), static_cast<int>(t.size()), SQLITE_TRANSIENT);
  }
  double number(int i) const {
    return sqlite3_column_type(s, i) == SQLITE_NULL ? std::numeric_limits<double>::quiet_NaN()
                                                    : sqlite3_column_double(s, i);
  }
  std::string text_of(int i) const {
    const auto* t = sqlite3_column_text(s, i);
    return t == nullptr ? std::string() : reinterpret_cast<const char*>(t);
  }
};

}  // namespace

void write_store(const std::string& store, const StoreIdentity& identity, std::uint64_t count,
                 const std::map<std::string, std::string>& notes,
                 const std::function<Block(std::uint64_t)>& rows) {
  const std::string aside = store + ".writing-" + std::to_string(::getpid());
  struct Remover {
    std::string path;
    ~Remover() { ::unlink(path.c_str()); }
  } remover{aside};
  ::unlink(aside.c_str());
  {
    Database db(aside, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
    // Nothing of it counts until it is renamed, so it needs no journal.
    db.run(
        "PRAGMA journal_mode=OFF; PRAGMA synchronous=OFF; PRAGMA page_size=8192;"
        "CREATE TABLE meta(key TEXT PRIMARY KEY, value TEXT);"
        "CREATE TABLE columns(position INTEGER PRIMARY KEY, name TEXT, role TEXT, meaning TEXT);");
    std::string names, marks;
    for (const auto& c : identity.columns) names += ", \"" + c.name + "\" REAL", marks += ", ?";
    db.run("CREATE TABLE trials(trial INTEGER PRIMARY KEY, seed INTEGER, health INTEGER" + names +
           ");BEGIN");
    {
      Statement meta(db, "INSERT INTO meta VALUES(?, ?)");
      auto put = [&](const std::string& key, const std::string& value) {
        meta.text(1, key);
        meta.text(2, value);
        meta.step();
        meta.reset();
      };
      put("identity", dump_json(identity_json(identity)));
      put("name", identity.name), put("kind", identity.kind), put("version", identity.version);
      put("seed", std::to_string(identity.seed)), put("config", identity.config),
          put("source", identity.source);
      for (const auto& [key, value] : notes) put(key, value);
      Statement column(db, "INSERT INTO columns VALUES(?, ?, ?, ?)");
      int position = 0;
      for (const auto& c : identity.columns) {
        sqlite3_bind_int(column.s, 1, position++);
        column.text(2, c.name), column.text(3, c.parameter ? "parameter" : "metric"),
            column.text(4, c.meaning);
        column.step();
        column.reset();
      }
    }
    Statement insert(db, "INSERT INTO trials VALUES(?, ?, ?" + marks + ")");
    const std::size_t width = identity.columns.size() + 1;
    for (std::uint64_t first = 0; first < count; first += identity.block) {
      const Block b = rows(first / identity.block);
      for (std::uint64_t i = 0; i < b.rows.size() / width && first + i < count; ++i) {
        const double* row = &b.rows[i * width];
        const std::uint64_t trial = first + i;
        sqlite3_bind_int64(insert.s, 1, static_cast<sqlite3_int64>(trial));
        sqlite3_bind_int64(insert.s, 2, static_cast<long long>(identity.seed));
        sqlite3_bind_int64(insert.s, 3, static_cast<long long>(row[width - 1]));
        for (std::size_t j = 0; j + 1 < width; ++j)
          sqlite3_bind_double(insert.s, static_cast<int>(j + 4), row[j]);
        insert.step();
        insert.reset();
      }
    }
    db.run("COMMIT");
  }
  Descriptor d(::open(aside.c_str(), O_RDONLY | O_CLOEXEC));
  if (d.file < 0 || ::fsync(d.file) != 0 || ::rename(aside.c_str(), store.c_str()) != 0)
    cannot_write(store, errno);
}

struct Store::Impl {
  Database db;
  StoreIdentity identity;
  std::map<std::string, std::string> notes;
  std::uint64_t trials = 0;
  std::string names;
  explicit Impl(const std::string& path) : db(path, SQLITE_OPEN_READONLY) {}
};

Store::Store(const std::string& path) {
  if (!fs::exists(path)) throw Error(ErrorKind::kInput, "no such campaign store", path);
  if (fs::is_directory(path))
    throw Error(ErrorKind::kInput, "expected a campaign store (one file), found a folder", path);
  impl_ = std::make_unique<Impl>(path);
  Statement meta(impl_->db, "SELECT key, value FROM meta");
  while (meta.step()) impl_->notes[meta.text_of(0)] = meta.text_of(1);
  try {
    impl_->identity = identity_from(Json::parse(impl_->notes.at("identity")));
  } catch (const std::exception&) {
    throw Error(ErrorKind::kInput, "not a campaign store: it does not say which campaign it holds",
                path);
  }
  impl_->notes.erase("identity");
  for (const auto& c : impl_->identity.columns) impl_->names += "\"" + c.name + "\", ";
  Statement count(impl_->db, "SELECT COUNT(*) FROM trials");
  if (count.step()) impl_->trials = static_cast<std::uint64_t>(sqlite3_column_int64(count.s, 0));
}
Store::~Store() = default;
const StoreIdentity& Store::identity() const { return impl_->identity; }
const std::map<std::string, std::string>& Store::notes() const { return impl_->notes; }
std::uint64_t Store::trials() const { return impl_->trials; }

std::vector<double> Store::column(const std::string& name, std::uint64_t stride) const {
  std::vector<double> v;
  v.reserve(impl_->trials / stride + 1);
  Statement s(impl_->db,
              "SELECT \"" + name + "\" FROM trials " +
                  (stride > 1 ? "WHERE trial % " + std::to_string(stride) + " = 0 " : "") +
                  "ORDER BY trial");
  while (s.step()) v.push_back(s.number(0));
  return v;
}
std::uint64_t Store::bad_trials() const {
  Statement s(impl_->db, "SELECT COUNT(*) FROM trials WHERE health != 0");
  return s.step() ? static_cast<std::uint64_t>(sqlite3_column_int64(s.s, 0)) : 0;
}
std::vector<double> Store::row(std::uint64_t trial) const {
  Statement s(impl_->db, "SELECT " + impl_->names +
                             "health FROM trials WHERE trial = " + std::to_string(trial));
  if (!s.step())
    throw Error(ErrorKind::kInput,
                "expected a trial from 0 to " + std::to_string(impl_->trials - 1) + ", found " +
                    std::to_string(trial),
                "--trial");
  std::vector<double> v;
  for (std::size_t j = 0; j <= impl_->identity.columns.size(); ++j)
    v.push_back(s.number(static_cast<int>(j)));
  return v;
}
Block Store::block(std::uint64_t index) const {
  const std::uint64_t first = index * impl_->identity.block;
  Statement s(impl_->db, "SELECT " + impl_->names + "health FROM trials WHERE trial >= " +
                             std::to_string(first) + " AND trial < " +
                             std::to_string(first + impl_->identity.block) + " ORDER BY trial");
  Block b;
  b.index = index;
  while (s.step())
    for (std::size_t j = 0; j <= impl_->identity.columns.size(); ++j)
      b.rows.push_back(s.number(static_cast<int>(j)));
  return b;
}

}  // namespace loxo
