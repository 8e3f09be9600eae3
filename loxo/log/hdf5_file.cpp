// SPDX-License-Identifier: Apache-2.0
#include "loxo/log/hdf5_file.hpp"

#include <hdf5.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <utility>

#include "loxo/num/error.hpp"
#include "loxo/text/aside.hpp"
#include "loxo/text/quantity.hpp"

namespace loxo {
namespace {

constexpr std::size_t kChunk = 16384;      // rows read and written at once
constexpr std::size_t kWidestMatrix = 64;  // columns; wider is no table of sensors
constexpr std::size_t kFrameWidth = 12;    // bytes of the words in use
constexpr std::size_t kWordWidth = 64;     // of any others
constexpr std::size_t kLongestText = 1u << 26;

void quiet() {
  static const bool once = [] {
    H5dont_atexit();  // after a failed write the library's own last cleaning crashes
    H5open();
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
    return true;
  }();
  static_cast<void>(once);
}

// The innermost reason of the library's last failure.
std::string reason() {
  std::string text;
  H5Ewalk2(
      H5E_DEFAULT, H5E_WALK_UPWARD,
      [](unsigned, const H5E_error2_t* e, void* to) -> herr_t {
        auto& s = *static_cast<std::string*>(to);
        if (s.empty() && e->desc != nullptr) s = e->desc;
        return 0;
      },
      &text);
  // "file write failed: time = …, error message = 'No space left on device', buf = …"
  const std::string mark = "error message = '";
  if (const auto at = text.find(mark); at != std::string::npos) {
    const auto from = at + mark.size();
    text = text.substr(from, text.find('\'', from) - from);
  }
  return text;
}

class Id {
 public:
  using Close = herr_t (*)(hid_t);
  Id() = default;
  Id(hid_t id, Close close) : id_(id), close_(close) {}
  ~Id() {
    if (id_ >= 0) close_(id_);
  }
  Id(Id&& o) noexcept : id_(std::exchange(o.id_, -1)), close_(o.close_) {}
  Id& operator=(Id&& o) noexcept {
    std::swap(id_, o.id_);
    std::swap(close_, o.close_);
    return *this;
  }
  Id(const Id&) = delete;
  Id& operator=(const Id&) = delete;
  operator hid_t() const { return id_; }
  bool ok() const { return id_ >= 0; }
  void release() { id_ = -1; }
  herr_t close() { return id_ < 0 ? 0 : close_(std::exchange(id_, -1)); }

 private:
  hid_t id_ = -1;
  Close close_ = nullptr;
};

// Link names cannot hold '/', and "." means the group itself.
std::string link_name(const std::string& column) {
  if (column.empty() || column == ".") return column.empty() ? "%" : "%2E";
  std::string out;
  for (const char c : column) {
    if (c == '/')
      out += "%2F";
    else if (c == '%')
      out += "%25";
    else
      out += c;
  }
  return out;
}
std::string column_name(const std::string& link) {
  if (link == "%") return "";
  std::string out;
  for (std::size_t i = 0; i < link.size(); ++i) {
    const std::string code = link.substr(i, 3);
    if (code == "%2F" || code == "%25" || code == "%2E") {
      out += code == "%2F" ? '/' : code == "%25" ? '%' : '.';
      i += 2;
    } else {
      out += link[i];
    }
  }
  return out;
}

[[noreturn]] void damaged(const std::string& path, const std::string& what) {
  const std::string why = reason();
  throw Error(ErrorKind::kInput,
              "HDF5 " + what + " cannot be read" + (why.empty() ? "" : " (" + why + ")") +
                  ": the file is damaged or not whole",
              path);
}

Id open_file(const std::string& path) {
  quiet();
  if (!std::ifstream(path, std::ios::binary))
    throw Error(ErrorKind::kInput, "no such file, or it cannot be opened", path);
  Id file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  if (!file.ok()) damaged(path, "file");
  return file;
}
bool exists(hid_t file, const std::string& name) {
  std::string part;
  for (std::size_t from = 0; from <= name.size();) {
    const auto to = std::min(name.find('/', from), name.size());
    part = name.substr(0, to);
    if (!part.empty() && H5Lexists(file, part.c_str(), H5P_DEFAULT) <= 0) return false;
    from = to + 1;
  }
  return true;
}

std::vector<std::string> links_of(hid_t group) {
  std::vector<std::string> names;
  const auto add = [](hid_t, const char* name, const H5L_info_t* info, void* to) -> herr_t {
    if (info->type == H5L_TYPE_HARD || info->type == H5L_TYPE_SOFT)
      static_cast<std::vector<std::string>*>(to)->emplace_back(name);
    return 0;
  };
  hsize_t at = 0;
  if (H5Literate(group, H5_INDEX_CRT_ORDER, H5_ITER_INC, &at, add, &names) < 0) {
    names.clear();  // files of others mostly keep no order of creation
    at = 0;
    H5Literate(group, H5_INDEX_NAME, H5_ITER_INC, &at, add, &names);
  }
  return names;
}

std::string string_of(hid_t from, hid_t type, bool attribute) {
  const auto read = [&](hid_t memory, void* to) {
    return attribute ? H5Aread(from, memory, to)
                     : H5Dread(from, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, to);
  };
  if (H5Tis_variable_str(type) > 0) {
    Id memory(H5Tcopy(H5T_C_S1), H5Tclose);
    H5Tset_size(memory, H5T_VARIABLE);
    H5Tset_cset(memory, H5Tget_cset(type));
    char* text = nullptr;
    if (read(memory, &text) < 0 || text == nullptr) return {};
    std::string out(text);
    H5free_memory(text);
    return out;
  }
  const std::size_t size = H5Tget_size(type);
  if (size == 0 || size > kLongestText) return {};
  std::string out(size, '\0');
  if (read(type, out.data()) < 0) return {};
  return out.substr(0, out.find('\0'));
}

// One dataset of a group, if it can be a column or several.
struct Dataset {
  std::string link;
  H5T_class_t type = H5T_NO_CLASS;
  hsize_t rows = 0, columns = 1;
  int rank = 0;
  bool transposed = false;  // MATLAB keeps columns first
};

std::vector<Dataset> datasets_of(hid_t group) {
  std::vector<Dataset> out;
  for (const auto& name : links_of(group)) {
    Id data(H5Oopen(group, name.c_str(), H5P_DEFAULT), H5Oclose);
    if (!data.ok() || H5Iget_type(data) != H5I_DATASET) continue;
    Id type(H5Dget_type(data), H5Tclose);
    Id space(H5Dget_space(data), H5Sclose);
    Dataset d;
    d.link = name;
    d.type = H5Tget_class(type);
    d.rank = H5Sget_simple_extent_ndims(space);
    if (d.rank < 1 || d.rank > 2) continue;
    if (d.type != H5T_INTEGER && d.type != H5T_FLOAT && d.type != H5T_STRING) continue;
    hsize_t size[2] = {0, 1};
    H5Sget_simple_extent_dims(space, size, nullptr);
    d.transposed = d.rank == 2 && H5Aexists(data, "MATLAB_class") > 0;
    d.rows = d.transposed ? size[1] : size[0];
    d.columns = d.rank == 1 ? 1 : d.transposed ? size[0] : size[1];
    if (d.rank == 2 && d.rows == 1 && d.columns > 1) {
      std::swap(d.rows, d.columns);  // a row vector
      d.transposed = !d.transposed;
    }
    if (d.columns > kWidestMatrix || (d.type == H5T_STRING && d.rank != 1)) continue;
    out.push_back(d);
  }
  return out;
}

std::map<std::string, std::string> attributes_of(hid_t object) {
  std::map<std::string, std::string> out;
  std::vector<std::string> names;
  hsize_t at = 0;
  H5Aiterate2(
      object, H5_INDEX_NAME, H5_ITER_INC, &at,
      [](hid_t, const char* name, const H5A_info_t*, void* to) -> herr_t {
        static_cast<std::vector<std::string>*>(to)->emplace_back(name);
        return 0;
      },
      &names);
  for (const auto& name : names) {
    Id a(H5Aopen(object, name.c_str(), H5P_DEFAULT), H5Aclose);
    if (!a.ok()) continue;
    Id type(H5Aget_type(a), H5Tclose);
    Id space(H5Aget_space(a), H5Sclose);
    if (H5Sget_simple_extent_npoints(space) != 1) continue;
    if (H5Tget_class(type) == H5T_STRING) {
      out[name] = string_of(a, type, true);
    } else if (H5Tget_class(type) == H5T_INTEGER || H5Tget_class(type) == H5T_FLOAT) {
      double x = 0;
      if (H5Aread(a, H5T_NATIVE_DOUBLE, &x) < 0) continue;
      char text[32];
      std::snprintf(text, sizeof text, "%.17g", x);
      out[name] = text;
    }
  }
  return out;
}

class H5Table : public Table {
 public:
  H5Table(const std::string& path, const std::string& group) : file_(open_file(path)) {
    path_ = path;
    const std::string name = group.empty() ? "/" : group;
    place_ = group.empty() ? path : path + ":" + group;
    if (name != "/" && !exists(file_, name)) {
      std::string found;
      for (const auto& t : h5_tables(path)) found += (found.empty() ? "" : ", ") + t;
      throw Error(ErrorKind::kInput,
                  "holds no group '" + group + "'; found: " + (found.empty() ? "none" : found),
                  path);
    }
    group_ = Id(H5Gopen2(file_, name.c_str(), H5P_DEFAULT), H5Gclose);
    if (!group_.ok()) damaged(path, "group '" + name + "'");
    convention_.format = "HDF5";
    meta_ = attributes_of(group_);
    meta_.erase("file");  // its name in drive.toml
    take_convention();
    choose_datasets();
  }
  void select(const std::vector<std::string>& columns) override {
    chosen_.clear();
    for (const auto& c : columns) {
      const std::size_t i = index(c);
      if (places_[i].word)
        throw Error(ErrorKind::kInput, "column '" + c + "' is text; expected numbers", place_);
      chosen_.push_back({i, open(places_[i])});
    }
    begin_ = end_ = at_ = 0;
  }
  bool next(std::span<double> row, Diagnostics&) override {
    if (at_ == end_ && !load()) return false;
    const std::size_t k = at_++ - begin_;
    for (std::size_t i = 0; i < chosen_.size(); ++i) row[i] = block_[i * kChunk + k];
    return true;
  }
  std::string_view word(const std::string& column) override {
    if (at_ == 0 || !has(column)) return {};
    const std::size_t i = index(column);
    if (!places_[i].word) return {};
    Words& w = words_[column];
    if (w.begin != begin_ || w.text.empty()) {
      w.begin = begin_;
      w.text = load_words(places_[i]);
    }
    const std::size_t k = at_ - 1 - begin_;
    return k < w.text.size() ? std::string_view(w.text[k]) : std::string_view();
  }
  std::vector<std::string> word_columns() override {
    std::vector<std::string> out;
    for (std::size_t i = 0; i < places_.size(); ++i)
      if (places_[i].word) out.push_back(header_[i]);
    return out;
  }
  std::size_t rows() const override { return at_; }
  std::string where() const override { return place_ + ": row " + std::to_string(at_); }

 private:
  struct Place {
    std::string link;
    int rank = 1;
    hsize_t column = 0;
    bool transposed = false, word = false;
  };
  struct Chosen {
    std::size_t place;
    Id data;
  };
  struct Words {
    std::size_t begin = static_cast<std::size_t>(-1);
    std::vector<std::string> text;
  };

  Id open(const Place& p) const {
    Id data(H5Dopen2(group_, p.link.c_str(), H5P_DEFAULT), H5Dclose);
    if (!data.ok()) damaged(place_, "column '" + p.link + "'");
    return data;
  }
  void choose_datasets() {
    auto sets = datasets_of(group_);
    for (const auto& d : sets)
      if (d.rank == 1 || d.rows > 1) length_ = std::max(length_, d.rows);
    for (const auto& d : sets) {
      if (d.rows != length_) {
        if (d.rows <= 1) continue;  // a constant beside the columns
        throw Error(ErrorKind::kInput,
                    "columns of different lengths: " + d.link + " has " + std::to_string(d.rows) +
                        " rows, others " + std::to_string(length_),
                    place_);
      }
      for (hsize_t c = 0; c < d.columns; ++c) {
        places_.push_back({d.link, d.rank, c, d.transposed, d.type == H5T_STRING});
        const std::string name = column_name(d.link);
        header_.push_back(d.columns == 1 ? name : name + "_" + std::to_string(c + 1));
      }
    }
    if (header_.empty()) {
      std::string found;
      for (const auto& t : h5_tables(path_)) found += (found.empty() ? "" : ", ") + t;
      throw Error(ErrorKind::kInput,
                  "holds no columns of numbers here" +
                      (found.empty() ? std::string() : "; tables in it: " + found),
                  place_);
    }
  }
  std::pair<Id, Id> spaces(const Place& p, hid_t data, hsize_t from, hsize_t n) const {
    Id space(H5Dget_space(data), H5Sclose);
    hsize_t start[2] = {from, p.column}, count[2] = {n, 1};
    if (p.transposed) std::swap(start[0], start[1]), std::swap(count[0], count[1]);
    if (H5Sselect_hyperslab(space, H5S_SELECT_SET, start, nullptr, count, nullptr) < 0)
      damaged(place_, "column '" + p.link + "'");
    return {std::move(space), Id(H5Screate_simple(1, &n, nullptr), H5Sclose)};
  }
  bool load() {
    if (end_ == length_) return false;
    begin_ = end_;
    const hsize_t n = std::min<hsize_t>(kChunk, length_ - begin_);
    block_.resize(chosen_.size() * kChunk);
    for (std::size_t i = 0; i < chosen_.size(); ++i) {
      const Place& p = places_[chosen_[i].place];
      const auto [file, memory] = spaces(p, chosen_[i].data, begin_, n);
      if (H5Dread(chosen_[i].data, H5T_NATIVE_DOUBLE, memory, file, H5P_DEFAULT,
                  block_.data() + i * kChunk) < 0)
        damaged(place_, "column '" + p.link + "'");
    }
    end_ = begin_ + n;
    return true;
  }
  std::vector<std::string> load_words(const Place& p) const {
    const Id data = open(p);
    const hsize_t n = end_ - begin_;
    Id type(H5Dget_type(data), H5Tclose);
    const auto [file, memory] = spaces(p, data, begin_, n);
    std::vector<std::string> out(n);
    if (H5Tis_variable_str(type) > 0) {
      std::vector<char*> text(n, nullptr);
      Id same(H5Tcopy(type), H5Tclose);
      if (H5Dread(data, same, memory, file, H5P_DEFAULT, text.data()) < 0)
        damaged(place_, "column '" + p.link + "'");
      for (std::size_t i = 0; i < n; ++i)
        if (text[i] != nullptr) out[i] = text[i];
      H5Dvlen_reclaim(same, memory, H5P_DEFAULT, text.data());
      return out;
    }
    const std::size_t width = H5Tget_size(type);
    std::vector<char> text(width * n);
    if (H5Dread(data, type, memory, file, H5P_DEFAULT, text.data()) < 0)
      damaged(place_, "column '" + p.link + "'");
    for (std::size_t i = 0; i < n; ++i) {
      const char* const s = text.data() + i * width;
      out[i].assign(s, static_cast<std::size_t>(std::find(s, s + width, '\0') - s));
    }
    return out;
  }

  Id file_, group_;
  std::string place_;
  hsize_t length_ = 0;
  std::vector<Place> places_;
  std::vector<Chosen> chosen_;
  std::vector<double> block_;
  std::map<std::string, Words> words_;
  std::size_t begin_ = 0, end_ = 0, at_ = 0;
};

// Groups that hold columns.
void find_tables(hid_t file, const std::string& at, int depth, std::vector<std::string>& out) {
  Id group(H5Gopen2(file, at.empty() ? "/" : at.c_str(), H5P_DEFAULT), H5Gclose);
  if (!group.ok()) return;
  if (!datasets_of(group).empty()) out.push_back(at);
  if (depth == 0) return;
  for (const auto& name : links_of(group)) {
    Id object(H5Oopen(group, name.c_str(), H5P_DEFAULT), H5Oclose);
    if (!name.starts_with('#') && object.ok() && H5Iget_type(object) == H5I_GROUP)
      find_tables(file, at.empty() ? name : at + "/" + name, depth - 1, out);
  }
}

}  // namespace

bool is_h5(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  char head[8]{};
  for (const std::streamoff at : {0, 512, 1024, 2048}) {  // after a block of the user's own
    in.clear();
    in.seekg(at);
    if (!in.read(head, sizeof head)) return false;
    if (std::memcmp(head, "\x89HDF\r\n\x1a\n", sizeof head) == 0) return true;
  }
  return false;
}

std::vector<std::string> h5_tables(const std::string& path) {
  const Id file = open_file(path);
  std::vector<std::string> out;
  find_tables(file, "", 4, out);
  return out;
}

std::optional<std::string> h5_text(const std::string& path, const std::string& name) {
  const Id file = open_file(path);
  if (!exists(file, name)) return std::nullopt;
  const Id data(H5Dopen2(file, name.c_str(), H5P_DEFAULT), H5Dclose);
  if (!data.ok()) return std::nullopt;
  const Id type(H5Dget_type(data), H5Tclose), space(H5Dget_space(data), H5Sclose);
  if (H5Tget_class(type) != H5T_STRING || H5Sget_simple_extent_npoints(space) != 1)
    return std::nullopt;
  return string_of(data, type, false);
}

std::unique_ptr<Table> open_h5_table(const std::string& path, const std::string& group) {
  return std::make_unique<H5Table>(path, group);
}

struct H5Writer::Impl {
  AsideFile aside;
  Id file, group;
  std::vector<std::string> columns;
  std::vector<bool> is_word;
  std::vector<Id> number_data, word_data;
  std::vector<std::vector<double>> block;
  std::vector<std::string> word_block;
  std::vector<std::size_t> width;
  std::size_t held = 0;  // rows in the block
  hsize_t written = 0;
  bool open_table = false;
  mutable bool failed = false;

  // What could not be written cannot be closed either: the library would try again, and crash.
  ~Impl() {
    if (!failed) return;
    for (auto* sets : {&number_data, &word_data})
      for (Id& d : *sets) d.release();
    group.release();
    file.release();
  }
  explicit Impl(const std::string& path) : aside(path) {
    quiet();
    Id access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
    H5Pset_libver_bounds(access, H5F_LIBVER_V110, H5F_LIBVER_LATEST);
    H5Pset_fclose_degree(access, H5F_CLOSE_STRONG);
    Id create(H5Pcreate(H5P_FILE_CREATE), H5Pclose);
    H5Pset_link_creation_order(create, H5P_CRT_ORDER_TRACKED | H5P_CRT_ORDER_INDEXED);
    file = Id(H5Fcreate(aside.temporary().c_str(), H5F_ACC_EXCL, create, access), H5Fclose);
    check(file.ok());
  }
  [[noreturn]] void fail() const {
    failed = true;
    const std::string why = reason();
    const bool full = why.find("No space") != std::string::npos ||
                      why.find("File too large") != std::string::npos ||
                      why.find("quota") != std::string::npos;
    throw Error(ErrorKind::kWork,
                (full ? "disk full: " : "cannot be written: ") + (why.empty() ? "HDF5" : why),
                aside.path());
  }
  void check(bool ok) const {
    if (!ok) fail();
  }
  static Id text_type(std::size_t n) {
    Id type(H5Tcopy(H5T_C_S1), H5Tclose);
    H5Tset_size(type, std::max<std::size_t>(n, 1));
    H5Tset_strpad(type, H5T_STR_NULLPAD);
    H5Tset_cset(type, H5T_CSET_UTF8);
    return type;
  }
  void attribute(hid_t object, const std::string& key, std::string_view value) const {
    const Id type = text_type(value.size());
    const Id space(H5Screate(H5S_SCALAR), H5Sclose);
    const Id a(H5Acreate2(object, key.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
    const std::string text = value.empty() ? std::string(1, '\0') : std::string(value);
    check(a.ok() && H5Awrite(a, type, text.data()) >= 0);
  }
  // A table that fits into one chunk takes no more room than its rows.
  Id make(const std::string& column, hid_t type, bool last) const {
    const hsize_t size = 0, most = H5S_UNLIMITED, whole = held;
    const hsize_t chunk = kChunk;
    Id create(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
    Id space(last ? H5Screate_simple(1, &whole, nullptr) : H5Screate_simple(1, &size, &most),
             H5Sclose);
    if (!last) H5Pset_chunk(create, 1, &chunk);
    H5Pset_obj_track_times(create, 0);  // the same rows make the same bytes
    Id data(
        H5Dcreate2(group, link_name(column).c_str(), type, space, H5P_DEFAULT, create, H5P_DEFAULT),
        H5Dclose);
    check(data.ok());
    if (const auto unit = unit_of_column(column); !unit.empty()) attribute(data, "unit", unit);
    return data;
  }
  void flush(bool last) {
    const bool first = written == 0;
    if (first) {
      for (std::size_t i = 0; i < columns.size(); ++i) {
        if (is_word[i])
          word_data.push_back(make(columns[i], text_type(width[word_data.size()]), last));
        else
          number_data.push_back(make(columns[i], H5T_IEEE_F64LE, last));
      }
    }
    if (held == 0) return;
    const hsize_t n = held, total = written + held;
    const Id memory(H5Screate_simple(1, &n, nullptr), H5Sclose);
    const auto put = [&](hid_t data, hid_t type, const void* from) {
      if (!(first && last)) check(H5Dset_extent(data, &total) >= 0);
      const Id space(H5Dget_space(data), H5Sclose);
      H5Sselect_hyperslab(space, H5S_SELECT_SET, &written, nullptr, &n, nullptr);
      check(H5Dwrite(data, type, memory, space, H5P_DEFAULT, from) >= 0);
    };
    for (std::size_t i = 0; i < number_data.size(); ++i)
      put(number_data[i], H5T_NATIVE_DOUBLE, block[i].data());
    for (std::size_t i = 0; i < word_data.size(); ++i)
      put(word_data[i], text_type(width[i]), word_block[i].data());
    written += held;
    held = 0;
  }
  void end() {
    if (!open_table) return;
    flush(true);
    for (auto* sets : {&number_data, &word_data}) {
      for (Id& d : *sets) check(d.close() >= 0);
      sets->clear();
    }
    check(group.close() >= 0);
    open_table = false;
  }
};

H5Writer::H5Writer(const std::string& path) : impl_(std::make_unique<Impl>(path)) {}
H5Writer::~H5Writer() = default;
H5Writer::H5Writer(H5Writer&&) noexcept = default;

void H5Writer::text(const std::string& name, std::string_view value) {
  const Impl& f = *impl_;
  const Id type = Impl::text_type(value.size());
  const Id space(H5Screate(H5S_SCALAR), H5Sclose);
  const Id create(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  H5Pset_obj_track_times(create, 0);
  const Id data(H5Dcreate2(f.file, name.c_str(), type, space, H5P_DEFAULT, create, H5P_DEFAULT),
                H5Dclose);
  const std::string bytes = value.empty() ? std::string(1, '\0') : std::string(value);
  f.check(data.ok() && H5Dwrite(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, bytes.data()) >= 0);
}

void H5Writer::link(const std::string& group, const std::string& as) {
  impl_->check(H5Lcreate_hard(impl_->file, group.c_str(), impl_->file, as.c_str(), H5P_DEFAULT,
                              H5P_DEFAULT) >= 0);
}

void H5Writer::begin(const std::string& group, const std::vector<std::string>& columns,
                     const std::vector<std::string>& words) {
  Impl& f = *impl_;
  f.end();
  if (group.empty()) {
    f.group = Id(H5Gopen2(f.file, "/", H5P_DEFAULT), H5Gclose);
  } else {
    const Id create(H5Pcreate(H5P_GROUP_CREATE), H5Pclose);
    H5Pset_link_creation_order(create, H5P_CRT_ORDER_TRACKED | H5P_CRT_ORDER_INDEXED);
    f.group = Id(H5Gcreate2(f.file, group.c_str(), H5P_DEFAULT, create, H5P_DEFAULT), H5Gclose);
  }
  f.check(f.group.ok());
  f.columns = columns;
  f.is_word.clear();
  f.block.clear();
  f.width.clear();
  f.word_block.clear();
  for (const auto& c : columns) {
    f.is_word.push_back(std::find(words.begin(), words.end(), c) != words.end());
    if (f.is_word.back()) {
      f.width.push_back(c == "frame" ? kFrameWidth : kWordWidth);
      f.word_block.emplace_back(f.width.back() * kChunk, '\0');
    } else {
      f.block.emplace_back(kChunk);
    }
  }
  f.held = 0;
  f.written = 0;
  f.open_table = true;
}

void H5Writer::attribute(const std::string& key, std::string_view value) {
  impl_->attribute(impl_->group, key, value);
}

void H5Writer::row(std::span<const double> numbers, std::span<const std::string_view> words) {
  Impl& f = *impl_;
  const std::size_t k = f.held;
  for (std::size_t i = 0; i < numbers.size(); ++i) f.block[i][k] = numbers[i];
  for (std::size_t i = 0; i < words.size(); ++i) {
    char* const to = f.word_block[i].data() + k * f.width[i];
    const std::size_t n = std::min(words[i].size(), f.width[i]);
    std::memcpy(to, words[i].data(), n);
    std::memset(to + n, 0, f.width[i] - n);
  }
  if (++f.held == kChunk) f.flush(false);
}

void H5Writer::commit() {
  Impl& f = *impl_;
  f.end();
  f.check(H5Fflush(f.file, H5F_SCOPE_LOCAL) >= 0);
  f.check(f.file.close() >= 0);
  f.aside.commit();
}

}  // namespace loxo
