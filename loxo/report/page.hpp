// SPDX-License-Identifier: Apache-2.0
// What a report page says, as values: any command fills a Page; page_html.hpp turns it into one
// self-contained file. Numbers are in the units that the labels name, except latitude and
// longitude, which are in radians. NaN is a gap. Vectors may have any length: they are thinned when
// written (minima and maxima kept).
#pragma once
#include <limits>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace loxo::report {

inline constexpr double kNoValue = std::numeric_limits<double>::quiet_NaN();

enum class Verdict { kNone, kGood, kBad, kNote };

// Paragraphs divided by blank lines; `code`, **strong**; lines that start with "- " are a list.
struct Text {
  std::string text{};
  Verdict verdict = Verdict::kNone;  // other than kNone: a marked box
};

struct KeyValues {
  std::string title{};
  std::vector<std::pair<std::string, std::string>> rows{};
};

struct Column {
  std::string title{};
  std::string unit{};  // shown under the title
};
// Text or a number; a number with `error` (1 sigma) is rounded to two digits of the error.
struct Cell {
  Cell(std::string words, Verdict v = Verdict::kNone) : text(std::move(words)), verdict(v) {}
  Cell(const char* words, Verdict v = Verdict::kNone) : text(words), verdict(v) {}
  Cell(double number, double sigma = kNoValue, Verdict v = Verdict::kNone)
      : value(number), error(sigma), verdict(v), is_number(true) {}
  std::string text{};  // with is_number: replaces the text made from value and error, if not empty
  double value = kNoValue, error = kNoValue;
  Verdict verdict = Verdict::kNone;
  bool is_number = false;
};
struct Row {
  std::vector<Cell> cells{};
  bool highlighted = false;
  std::string note{};  // a small line under the row
};
struct Table {
  std::string title{}, caption{};
  std::vector<Column> columns{};
  std::vector<Row> rows{};
};

enum class Style { kLine, kDashed, kPoints, kLinePoints, kSteps };
struct Axis {
  std::string label{}, unit{};
  bool log = false;
  double lo = kNoValue, hi = kNoValue;  // fixed range; NaN: from the data
};
struct Mark {
  double at = 0;
  std::string label{};
  bool horizontal = false;  // a line at y = at instead of x = at
};
struct Span {  // a shaded stretch of x: a phase, an outage
  double from = 0, to = 0;
  std::string label{};
};
// One y series. Equal names have equal colours everywhere on a page ("truth" is drawn in ink).
struct Curve {
  std::string name{};
  std::vector<double> y{};
  std::vector<double> x{};  // empty: the figure's x; ascending (else use Scatter with Cloud::line)
  std::vector<double> lo{}, hi{};  // a band, absolute values; empty: none
  Style style = Style::kLine;
  std::string source{};  // curves of one source are switched together; empty: the name
  int colour = -1;       // 0..9 of the palette; -1: by name
  bool shown = true;
};
// Lines over x, zoomable; figures with equal `sync` share cursor and zoom.
struct Series {
  std::string title{}, caption{};
  Axis x{}, y{};
  std::vector<double> at{};  // the shared x
  std::vector<Curve> curves{};
  std::vector<Mark> marks{};
  std::vector<Span> spans{};
  std::string sync{};
  bool half = false;  // may stand beside another figure
};

struct Track {
  std::string name{};
  std::vector<double> lat{}, lon{};  // rad
  std::vector<double> t{};           // s, may be empty; same clock as the Series it is shown with
  Style style = Style::kLine;
  int colour = -1;
};
enum class PointKind { kBenchmark, kStart, kEnd, kFix, kOther };
struct MapPoint {
  std::string name{};
  double lat = 0, lon = 0;                                     // rad
  double std_e = kNoValue, std_n = kNoValue, correlation = 0;  // m: error ellipse, 95 %
  PointKind kind = PointKind::kBenchmark;
};
// The projection is chosen from where the tracks lie: a plane in metres (below 100 km), else
// stereographic or azimuthal equidistant, centred on the pole where the track comes near it; right
// at 90 degrees and across +-180.
struct Map {
  std::string title{}, caption{};
  std::vector<Track> tracks{};
  std::vector<MapPoint> points{};
};

struct Sample {
  std::string name{};
  std::vector<double> values{};
};
struct Histogram {
  std::string title{}, caption{};
  Axis x{};
  std::vector<Sample> samples{};
  int bins = 0;         // 0: Freedman-Diaconis
  bool normal = false;  // the normal curve of each sample's mean and standard deviation over it
  std::vector<Mark> marks{};
};
struct Cdf {
  std::string title{}, caption{};
  Axis x{};
  std::vector<Sample> samples{};
  std::vector<double> percentiles{50, 95};  // marked and written into the legend
};
struct Cloud {
  std::string name{};
  std::vector<double> x{}, y{};
  bool line = false;  // joined in the order given: a curve whose x goes back and forth
};
struct Ellipse {  // the `confidence` ellipse of a covariance
  std::string name{};
  double x = 0, y = 0, sxx = 0, sxy = 0, syy = 0;
  double confidence = 0.95;
};
struct Scatter {
  std::string title{}, caption{};
  Axis x{}, y{};
  std::vector<Cloud> clouds{};
  std::vector<Ellipse> ellipses{};
  std::vector<Mark> marks{};
  bool equal = false;  // one unit of x is as long as one of y
};
struct Layer {
  std::string name{};
  std::vector<double> y{};
};
struct StackedArea {  // layers add up (variances do, standard deviations do not)
  std::string title{}, caption{};
  Axis x{}, y{};
  std::vector<double> at{};
  std::vector<Layer> layers{};
};
struct Root {
  std::string name{};
  double re = 0, im = 0;  // 1/s
};
struct Roots {
  std::string title{}, caption{};
  std::vector<Root> roots{};
};
struct Percentile {
  double percent = 50;
  std::vector<double> y{};
};
struct Fan {  // nested bands between percentiles p and 100 - p, the median as a line
  std::string title{}, caption{};
  Axis x{}, y{};
  std::vector<double> at{};
  std::vector<Percentile> percentiles{};
  std::vector<Curve> curves{};  // single trials over it
};
// Values with error bars, one a row: methods side by side.
struct Interval {
  std::string name{};
  double value = 0, sigma = kNoValue;
  bool highlighted = false;
};
struct Intervals {
  std::string title{}, caption{};
  Axis x{};
  std::vector<Interval> rows{};
  double reference = kNoValue;  // drawn as a line
  std::string reference_name{};
};
struct Constant {
  std::string name{};
  double value = 0, sigma = kNoValue;
  std::string unit{};
};
struct Certificate {
  std::string title{}, verdict_text{};
  Verdict verdict = Verdict::kGood;
  std::vector<Constant> constants{};
  std::vector<std::vector<double>> correlation{};  // of the constants, may be empty
  std::vector<std::pair<std::string, std::string>> rows{};
};

using Block = std::variant<Text, KeyValues, Table, Series, Map, Histogram, Cdf, Scatter,
                           StackedArea, Roots, Fan, Intervals, Certificate>;

struct Section {
  std::string title{};
  std::vector<Block> blocks{};
  std::string group{};  // sections of one group are one entry of the contents list
};

struct Page {
  std::string title{}, subtitle{};
  std::vector<std::pair<std::string, std::string>>
      provenance{};  // program version, command, input hashes …
  std::vector<Section> sections{};
};

}  // namespace loxo::report
