// SPDX-License-Identifier: Apache-2.0
#include "loxo/text/toml.hpp"

#include <cmath>
#include <map>
#include <set>
#define TOML_ENABLE_FORMATTERS 0
#include <toml++/toml.h>

#include "loxo/num/error.hpp"
#include "loxo/text/gzip.hpp"
#include "loxo/text/nearest.hpp"

namespace loxo {
namespace {

struct Root {
  toml::table table;
  std::string name;
  std::map<const toml::table*, std::set<std::string, std::less<>>> asked;
};

std::string place(const std::string& file, const toml::source_region& region) {
  if (region.begin.line == 0) return file;
  if (region.path && *region.path == "--set") return "--set";
  return file + ":" + std::to_string(region.begin.line) + ":" + std::to_string(region.begin.column);
}

std::string type_name(const toml::node& node) {
  switch (node.type()) {
    case toml::node_type::table:
      return "a table";
    case toml::node_type::array:
      return "a list";
    case toml::node_type::string:
      return "text";
    case toml::node_type::integer:
      return "a whole number";
    case toml::node_type::floating_point:
      return "a number";
    case toml::node_type::boolean:
      return "true or false";
    default:
      return "a date or time";
  }
}

}  // namespace

struct TomlTable::Impl {
  std::shared_ptr<Root> root;
  toml::table* table = nullptr;
  std::string path;

  std::string dotted(std::string_view key) const {
    return path.empty() ? std::string(key) : path + "." + std::string(key);
  }
  const toml::node* ask(std::string_view key) const {
    root->asked[table].emplace(key);
    return table->get(key);
  }
  std::string where(std::string_view key) const {
    const toml::node* node = table->get(key);
    if (node == nullptr) return place(root->name, table->source()) + ": key " + dotted(key);
    return place(root->name, node->source()) + ": key " + dotted(key);
  }
  [[noreturn]] void wrong(std::string_view key, const toml::node& node,
                          const std::string& expected) const {
    throw Error(ErrorKind::kInput, "expected " + expected + ", found " + type_name(node),
                where(key));
  }
  [[noreturn]] void missing(std::string_view key, const std::string& expected) const {
    throw Error(ErrorKind::kInput, "missing; expected " + expected, where(key));
  }
  double number(std::string_view key, const toml::node& node) const {
    double x = 0;
    if (const auto* i = node.as_integer()) {
      x = static_cast<double>(i->get());
    } else if (const auto* f = node.as_floating_point()) {
      x = f->get();
    } else {
      wrong(key, node, "a number");
    }
    if (!std::isfinite(x)) throw Error(ErrorKind::kInput, "expected a finite number", where(key));
    return x;
  }
  double quantity(std::string_view key, const toml::node& node, Dimension d) const {
    if (const auto* s = node.as_string()) return parse_quantity(s->get(), d, where(key));
    if (node.is_number()) {
      if (d == Dimension::kNone) return number(key, node);
      const std::string text = node.is_integer() ? std::to_string(node.as_integer()->get()) : [&] {
        char buffer[32];
        std::snprintf(buffer, sizeof buffer, "%g", node.as_floating_point()->get());
        return std::string(buffer);
      }();
      return parse_quantity(text, d, where(key));  // refuses a bare number in its own words
    }
    wrong(key, node, std::string(dimension_name(d)) + " as text with its unit");
  }
  const toml::array* array(std::string_view key, const std::string& expected) const {
    const toml::node* node = ask(key);
    if (node == nullptr) return nullptr;
    if (!node->is_array()) wrong(key, *node, expected);
    return node->as_array();
  }
};

TomlTable TomlTable::read(const std::string& path) { return parse(read_file(path), path); }

TomlTable TomlTable::parse(std::string_view text, const std::string& name) {
  if (text.substr(0, 3) == "\xef\xbb\xbf") text.remove_prefix(3);
  TomlTable t;
  t.impl_ = std::make_shared<Impl>();
  t.impl_->root = std::make_shared<Root>();
  t.impl_->root->name = name;
  try {
    t.impl_->root->table = toml::parse(text);
  } catch (const toml::parse_error& e) {
    throw Error(ErrorKind::kInput, "not valid TOML: " + std::string(e.description()),
                place(name, e.source()));
  }
  t.impl_->table = &t.impl_->root->table;
  return t;
}

bool TomlTable::has(std::string_view key) const { return impl_->ask(key) != nullptr; }
std::vector<std::string> TomlTable::keys() const {
  std::vector<std::string> names;
  for (const auto& [key, node] : *impl_->table) names.emplace_back(key.str());
  return names;
}
std::string TomlTable::where(std::string_view key) const { return impl_->where(key); }
std::string TomlTable::path() const { return impl_->path; }

std::optional<std::string> TomlTable::get_string(std::string_view key) const {
  const toml::node* node = impl_->ask(key);
  if (node == nullptr) return std::nullopt;
  const auto* s = node->as_string();
  if (s == nullptr) impl_->wrong(key, *node, "text");
  return s->get();
}
std::optional<double> TomlTable::get_number(std::string_view key) const {
  const toml::node* node = impl_->ask(key);
  if (node == nullptr) return std::nullopt;
  return impl_->number(key, *node);
}
std::optional<long long> TomlTable::get_integer(std::string_view key) const {
  const toml::node* node = impl_->ask(key);
  if (node == nullptr) return std::nullopt;
  const auto* i = node->as_integer();
  if (i == nullptr) impl_->wrong(key, *node, "a whole number");
  return i->get();
}
std::optional<bool> TomlTable::get_bool(std::string_view key) const {
  const toml::node* node = impl_->ask(key);
  if (node == nullptr) return std::nullopt;
  const auto* b = node->as_boolean();
  if (b == nullptr) impl_->wrong(key, *node, "true or false");
  return b->get();
}
std::optional<double> TomlTable::get_quantity(std::string_view key, Dimension d) const {
  const toml::node* node = impl_->ask(key);
  if (node == nullptr) return std::nullopt;
  return impl_->quantity(key, *node, d);
}
std::optional<std::array<double, 3>> TomlTable::get_vector3(std::string_view key,
                                                            Dimension d) const {
  const toml::node* node = impl_->ask(key);
  if (node == nullptr) return std::nullopt;
  if (const auto* s = node->as_string()) return parse_vector3(s->get(), d, impl_->where(key));
  if (const auto* list = node->as_array()) {
    if (list->size() != 3)
      throw Error(ErrorKind::kInput, "expected three values, found " + std::to_string(list->size()),
                  impl_->where(key));
    std::array<double, 3> v{};
    for (std::size_t i = 0; i < 3; ++i) v[i] = impl_->quantity(key, *list->get(i), d);
    return v;
  }
  impl_->wrong(key, *node, "three numbers and a unit as text, \"0.4 -1.2 -0.6 m\"");
}
std::optional<std::vector<std::string>> TomlTable::get_strings(std::string_view key) const {
  const auto* list = impl_->array(key, "a list of texts");
  if (list == nullptr) return std::nullopt;
  std::vector<std::string> values;
  for (const auto& node : *list) {
    if (!node.is_string()) impl_->wrong(key, node, "a list of texts");
    values.push_back(node.as_string()->get());
  }
  return values;
}
std::optional<std::vector<double>> TomlTable::get_numbers(std::string_view key) const {
  const auto* list = impl_->array(key, "a list of numbers");
  if (list == nullptr) return std::nullopt;
  std::vector<double> values;
  for (const auto& node : *list) values.push_back(impl_->number(key, node));
  return values;
}
std::optional<std::vector<double>> TomlTable::get_quantities(std::string_view key,
                                                             Dimension d) const {
  const auto* list = impl_->array(key, "a list of quantities");
  if (list == nullptr) return std::nullopt;
  std::vector<double> values;
  for (const auto& node : *list) values.push_back(impl_->quantity(key, node, d));
  return values;
}
std::optional<TomlTable> TomlTable::get_table(std::string_view key) const {
  const toml::node* node = impl_->ask(key);
  if (node == nullptr) return std::nullopt;
  if (!node->is_table()) impl_->wrong(key, *node, "a table");
  TomlTable t;
  t.impl_ = std::make_shared<Impl>(*impl_);
  t.impl_->table = impl_->table->get(key)->as_table();
  t.impl_->path = impl_->dotted(key);
  return t;
}
std::vector<TomlTable> TomlTable::get_tables(std::string_view key) const {
  std::vector<TomlTable> tables;
  const toml::node* node = impl_->ask(key);
  if (node == nullptr) return tables;
  if (!node->is_array())
    impl_->wrong(key, *node, "an array of tables, [[" + impl_->dotted(key) + "]]");
  auto& list = *impl_->table->get(key)->as_array();
  for (std::size_t i = 0; i < list.size(); ++i) {
    if (!list[i].is_table())
      impl_->wrong(key, list[i], "an array of tables, [[" + impl_->dotted(key) + "]]");
    TomlTable t;
    t.impl_ = std::make_shared<Impl>(*impl_);
    t.impl_->table = list[i].as_table();
    t.impl_->path = impl_->dotted(key) + "[" + std::to_string(i) + "]";
    tables.push_back(std::move(t));
  }
  return tables;
}
std::string TomlTable::need_string(std::string_view key) const {
  auto v = get_string(key);
  if (!v) impl_->missing(key, "text");
  return *v;
}
double TomlTable::need_number(std::string_view key) const {
  const auto v = get_number(key);
  if (!v) impl_->missing(key, "a number");
  return *v;
}
double TomlTable::need_quantity(std::string_view key, Dimension d) const {
  const auto v = get_quantity(key, d);
  if (!v) impl_->missing(key, std::string(dimension_name(d)));
  return *v;
}

void TomlTable::set(std::string_view dotted_key, std::string_view value) {
  const std::string where = "--set " + std::string(dotted_key);
  toml::table parsed;
  try {
    parsed = toml::parse("value = " + std::string(value) + "\n", std::string_view("--set"));
    if (parsed.size() != 1) parsed.clear();
  } catch (const toml::parse_error&) {
    parsed.clear();
  }
  if (parsed.empty()) parsed.insert("value", std::string(value));

  toml::table* table = impl_->table;
  std::string_view rest = dotted_key;
  for (;;) {
    const auto dot = rest.find('.');
    const std::string_view key = rest.substr(0, dot);
    if (key.empty())
      throw Error(ErrorKind::kUsage, "expected key=value with a dotted key, as imu.axes=FRD",
                  where);
    if (dot == std::string_view::npos) {
      table->insert_or_assign(key, std::move(*parsed.get("value")));
      return;
    }
    rest.remove_prefix(dot + 1);
    toml::node* node = table->get(key);
    if (node == nullptr) node = &table->insert(key, toml::table{}).first->second;
    if (auto* list = node->as_array()) {  // benchmark.0.std
      const auto next = rest.find('.');
      const std::string index(rest.substr(0, next));
      const bool digits = !index.empty() &&
                          index.find_first_not_of("0123456789") == std::string::npos &&
                          index.size() < 9;
      if (!digits || std::stoul(index) >= list->size() || next == std::string_view::npos) {
        throw Error(ErrorKind::kUsage,
                    "'" + std::string(key) + "' is a list of " + std::to_string(list->size()) +
                        "; expected " + std::string(key) + ".INDEX.key, INDEX from 0",
                    where);
      }
      node = list->get(std::stoul(index));
      rest.remove_prefix(next + 1);
    }
    table = node->as_table();
    if (table == nullptr)
      throw Error(ErrorKind::kUsage, "'" + std::string(key) + "' is not a table", where);
  }
}

void TomlTable::refuse_unknown() const {
  const auto& asked = impl_->root->asked[impl_->table];
  for (const auto& [key, node] : *impl_->table) {
    if (!asked.contains(key.str())) {
      const std::vector<std::string> valid(asked.begin(), asked.end());
      throw Error(ErrorKind::kInput,
                  "unknown key '" + std::string(key.str()) + "'" + suggestion(key.str(), valid),
                  (key.source().begin.line == 0 ? impl_->where(key.str())
                                                : place(impl_->root->name, key.source()) +
                                                      ": key " + impl_->dotted(key.str())));
    }
    if (node.is_table() && impl_->root->asked.contains(node.as_table()))
      get_table(key.str())->refuse_unknown();
    if (const auto* list = node.as_array();
        list != nullptr && !list->empty() && list->get(0)->is_table()) {
      for (const auto& t : get_tables(key.str())) t.refuse_unknown();
    }
  }
}

}  // namespace loxo
