// SPDX-License-Identifier: Apache-2.0
#include "loxo/log/matlab_file.hpp"

#include <matio.h>

#include <algorithm>
#include <cstdint>

#include "loxo/num/error.hpp"

namespace loxo {
namespace {

constexpr std::size_t kWidest = 64;    // columns of a matrix that is a table
constexpr std::size_t kSideways = 16;  // rows of a matrix that lies on its side
constexpr int kDeepest = 4;            // structs in structs

struct Array {
  std::string group, name;
  std::vector<std::vector<double>> columns;
  std::size_t rows() const { return columns[0].size(); }
};
struct MatTable {
  std::string name;
  std::vector<const Array*> arrays;
};

// Element i of a variable's data; false where it is no real number.
template <class T>
void copy(const matvar_t& v, std::vector<double>& to) {
  const T* const from = static_cast<const T*>(v.data);
  for (std::size_t i = 0; i < to.size(); ++i) to[i] = static_cast<double>(from[i]);
}
bool numbers(const matvar_t& v, std::vector<double>& to) {
  if (v.data == nullptr || v.isComplex != 0) return false;
  switch (v.class_type) {
    case MAT_C_DOUBLE:
    case MAT_C_SINGLE:
    case MAT_C_INT8:
    case MAT_C_UINT8:
    case MAT_C_INT16:
    case MAT_C_UINT16:
    case MAT_C_INT32:
    case MAT_C_UINT32:
    case MAT_C_INT64:
    case MAT_C_UINT64:
      break;
    default:
      return false;
  }
  if (v.nbytes / static_cast<std::size_t>(std::max(v.data_size, 1)) < to.size()) return false;
  switch (v.data_type) {  // as it stands in memory, whatever the class
    case MAT_T_DOUBLE:
      copy<double>(v, to);
      return true;
    case MAT_T_SINGLE:
      copy<float>(v, to);
      return true;
    case MAT_T_INT8:
      copy<std::int8_t>(v, to);
      return true;
    case MAT_T_UINT8:
      copy<std::uint8_t>(v, to);
      return true;
    case MAT_T_INT16:
      copy<std::int16_t>(v, to);
      return true;
    case MAT_T_UINT16:
      copy<std::uint16_t>(v, to);
      return true;
    case MAT_T_INT32:
      copy<std::int32_t>(v, to);
      return true;
    case MAT_T_UINT32:
      copy<std::uint32_t>(v, to);
      return true;
    case MAT_T_INT64:
      copy<std::int64_t>(v, to);
      return true;
    case MAT_T_UINT64:
      copy<std::uint64_t>(v, to);
      return true;
    default:
      return false;
  }
}

void gather(const matvar_t& v, const std::string& group, int depth, std::vector<Array>& out) {
  const std::string name = v.name == nullptr ? "" : v.name;
  if (v.class_type == MAT_C_STRUCT) {
    if (depth == 0 || v.rank != 2 || v.dims[0] * v.dims[1] != 1 || v.data == nullptr) return;
    const unsigned n = Mat_VarGetNumberOfFields(const_cast<matvar_t*>(&v));
    for (unsigned i = 0; i < n; ++i) {
      const matvar_t* const field = Mat_VarGetStructFieldByIndex(const_cast<matvar_t*>(&v), i, 0);
      if (field != nullptr)
        gather(*field, group.empty() ? name : group + "." + name, depth - 1, out);
    }
    return;
  }
  if (v.rank != 2) return;
  std::size_t rows = v.dims[0], columns = v.dims[1];
  if (rows == 0 || columns == 0) return;
  const bool sideways = rows < columns && rows <= kSideways;
  if ((sideways ? rows : columns) > kWidest) return;
  std::vector<double> data(rows * columns);
  if (!numbers(v, data)) return;
  Array a{group, name, {}};
  const std::size_t down = rows;
  if (sideways) std::swap(rows, columns);
  if (rows < 2) return;  // a constant
  a.columns.assign(columns, std::vector<double>(rows));
  for (std::size_t c = 0; c < columns; ++c)
    for (std::size_t r = 0; r < rows; ++r)
      a.columns[c][r] = sideways ? data[r * down + c] : data[c * down + r];
  out.push_back(std::move(a));
}

std::vector<Array> arrays_of(const std::string& path) {
  static const bool quiet = [] {
    Mat_LogInitFunc("loxo", [](int, char*) {});
    return true;
  }();
  static_cast<void>(quiet);
  mat_t* const file = Mat_Open(path.c_str(), MAT_ACC_RDONLY);
  if (file == nullptr)
    throw Error(ErrorKind::kInput, "a MATLAB file that cannot be read: damaged or not whole", path);
  std::vector<Array> out;
  while (matvar_t* const v = Mat_VarReadNext(file)) {
    gather(*v, "", kDeepest, out);
    Mat_VarFree(v);
  }
  Mat_Close(file);
  if (out.empty())
    throw Error(ErrorKind::kInput,
                "a MATLAB file without matrices of numbers that could be columns", path);
  return out;
}

std::vector<MatTable> tables_in(const std::vector<Array>& arrays) {
  std::vector<MatTable> out;
  for (const Array& a : arrays) {
    const auto same = std::find_if(out.begin(), out.end(), [&](const MatTable& t) {
      return t.arrays[0]->group == a.group && t.arrays[0]->rows() == a.rows();
    });
    if (same == out.end())
      out.push_back({"", {&a}});
    else
      same->arrays.push_back(&a);
  }
  for (MatTable& t : out) {
    const auto alone = std::count_if(out.begin(), out.end(), [&](const MatTable& o) {
      return o.arrays[0]->group == t.arrays[0]->group;
    });
    const Array& first = *t.arrays[0];
    t.name = alone == 1            ? first.group
             : first.group.empty() ? first.name
                                   : first.group + "." + first.name;
  }
  return out;
}

}  // namespace

std::vector<std::string> mat_tables(const std::string& path) {
  const auto arrays = arrays_of(path);
  std::vector<std::string> out;
  for (const MatTable& t : tables_in(arrays)) out.push_back(t.name);
  return out;
}

std::unique_ptr<Table> open_mat_table(const std::string& path, const std::string& table) {
  const auto arrays = arrays_of(path);
  const auto tables = tables_in(arrays);
  const MatTable* chosen = nullptr;
  std::string found;
  for (const MatTable& t : tables) {
    found += (found.empty() ? "" : ", ") + (t.name.empty() ? "(variables)" : t.name) + " (" +
             std::to_string(t.arrays[0]->rows()) + " rows)";
    bool named = t.name == table || (table.empty() && tables.size() == 1);
    for (const Array* a : t.arrays)
      named = named || (a->group.empty() ? a->name : a->group + "." + a->name) == table;
    if (named && chosen == nullptr) chosen = &t;
  }
  if (chosen == nullptr)
    throw Error(ErrorKind::kInput,
                (table.empty() ? std::string("holds several tables; say table = \"…\"")
                               : "holds no table '" + table + "'") +
                    "; found: " + found,
                path);
  std::vector<std::string> header;
  std::vector<std::vector<double>> columns;
  for (const Array* a : chosen->arrays) {
    for (std::size_t c = 0; c < a->columns.size(); ++c) {
      header.push_back(a->columns.size() == 1 ? a->name : a->name + "_" + std::to_string(c + 1));
      columns.push_back(a->columns[c]);
    }
  }
  TableConvention convention;
  convention.format = "MATLAB";
  return std::make_unique<MemoryTable>(path, convention, std::move(header), std::move(columns));
}

}  // namespace loxo
