#include "registration/tracking/holding_file.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/json_place.h"
#include "core/io/toml.h"
#include "core/limits.h"
#include "core/utf8.h"

namespace atelier {
namespace {

constexpr double kLongest = 100;   // m
constexpr double kStiffest = 1e6;  // N
constexpr std::string_view kFileHead =
    "# What holds the garments on the body (docs/reference/formats.md). Of a band the vertices "
    "move\n"
    "# with the body, and it pulls where the body is larger than rest_girth; what rests hangs by\n"
    "# contact and friction and is only watched. Remove a table, or change kind, rest_girth,\n"
    "# stiffness or vertices, and give the file to simulate, animate or material as --holding.\n";

std::string quoted(const std::string& text) {
  return nlohmann::json(text).dump();  // TOML's basic strings are JSON's
}

void append_number(std::string& text, const char* name, double value, const char* comment) {
  char line[120];
  std::snprintf(line, sizeof line, "%s = %.6g  # %s\n", name, value, comment);
  text += line;
}

double bounded(const JsonPlace& place, double most, const char* expected) {
  const double value = place.number();
  if (!(value >= 0 && value <= most)) {
    place.fail(place.value().dump(), expected);
  }
  return value;
}

HoldingKind kind_at(const JsonPlace& place) {
  const std::string& text = place.text();
  if (text != "band" && text != "rest") {
    place.fail("'" + text.substr(0, 40) + "'", "band or rest");
  }
  return text == "band" ? HoldingKind::Band : HoldingKind::Rest;
}

std::string printable_at(const JsonPlace& place) {
  const std::string& text = place.text();
  if (text.empty() || !is_printable_utf8(text)) {
    place.fail(text.empty() ? "an empty name" : "no printable text", "a name");
  }
  return text;
}

std::vector<int> vertices_at(const JsonPlace& place) {
  std::vector<int> vertices;
  for (const JsonPlace& one : place.items()) {
    vertices.push_back(static_cast<int>(one.integer(0, std::numeric_limits<int>::max())));
  }
  if (vertices.size() < 2) {
    place.fail(std::to_string(vertices.size()) + " vertices", "two or more, in order");
  }
  if (std::set<int>(vertices.begin(), vertices.end()).size() < vertices.size()) {
    place.fail("a vertex twice", "each vertex of the ring once");
  }
  return vertices;
}

HeldRing ring_at(const JsonPlace& place) {
  constexpr std::array kFields = {"garment",    "opening",   "kind",     "closed",
                                  "rest_girth", "stiffness", "vertices", "girth",
                                  "body_girth", "gap",       "deviation"};
  constexpr const char* kLength = "metres, 0 to 100";
  HeldRing ring;
  ring.garment = printable_at(place.at("garment"));
  for (const auto& [name, unused] : place.value().items()) {
    if (std::find(kFields.begin(), kFields.end(), name) == kFields.end()) {
      place.fail("'" + name.substr(0, 40) + "'",
                 "garment, opening, kind, closed, rest_girth, stiffness, vertices, girth, "
                 "body_girth, gap and deviation");
    }
  }
  if (const auto opening = place.find("opening")) {
    ring.opening = printable_at(*opening);
  } else {
    ring.opening = "opening";
  }
  ring.kind = kind_at(place.at("kind"));
  ring.closed = place.boolean_or("closed", true);
  ring.vertices = vertices_at(place.at("vertices"));
  const auto length = [&](const char* name, double& value) {
    if (const auto found = place.find(name)) {
      value = bounded(*found, kLongest, kLength);
    }
  };
  length("rest_girth", ring.rest_girth);
  length("girth", ring.girth);
  length("body_girth", ring.body_girth);
  length("gap", ring.gap);
  length("deviation", ring.deviation);
  if (const auto found = place.find("stiffness")) {
    ring.stiffness = bounded(*found, kStiffest, "newtons per unit of strain, 0 to 1e6");
  }
  return ring;
}

}  // namespace

std::string holding_text(const std::vector<HeldRing>& rings) {
  std::string text(kFileHead);
  if (rings.empty()) {
    text += "held = []  # nothing was found that holds a garment\n";
  }
  for (const HeldRing& ring : rings) {
    text += "\n[[held]]\ngarment = " + quoted(ring.garment) +
            "\nopening = " + quoted(ring.opening) +
            "\nkind = " + (ring.kind == HoldingKind::Band ? "\"band\"" : "\"rest\"") +
            "\nclosed = " + (ring.closed ? "true" : "false") + "\n";
    append_number(text, "rest_girth", ring.rest_girth, "m, without tension; 0: does not pull");
    append_number(text, "stiffness", ring.stiffness, "N, tension per unit of strain");
    append_number(text, "girth", ring.girth, "m, as registered");
    append_number(text, "body_girth", ring.body_girth, "m, of the body under it");
    append_number(text, "gap", ring.gap, "m, from the skin");
    append_number(text, "deviation", ring.deviation, "m, by which it changes its place");
    text += "vertices = [";
    for (std::size_t i = 0; i < ring.vertices.size(); ++i) {
      text += (i == 0 ? "" : i % 16 == 0 ? ",\n  " : ", ") + std::to_string(ring.vertices[i]);
    }
    text += "]\n";
  }
  return text;
}

std::vector<HeldRing> parse_holding(std::string_view text, const std::string& file) {
  const nlohmann::json parsed = parse_toml(text, file);
  const JsonPlace all(parsed, file);
  if (!all.has("held")) {
    throw DataError(file, "", "no table [[held]]",
                    "one for each ring that holds a garment, or held = [] for none");
  }
  std::vector<HeldRing> rings;
  for (const JsonPlace& place : all.items("held")) {
    rings.push_back(ring_at(place));
  }
  return rings;
}

std::vector<HeldRing> read_holding(const std::filesystem::path& path) {
  return parse_holding(read_file_text(path, Limits().text_file_bytes), path.string());
}

void require_holding(const std::vector<HeldRing>& rings, const std::vector<HeldGarment>& garments,
                     const std::string& file) {
  for (std::size_t i = 0; i < rings.size(); ++i) {
    const HeldRing& ring = rings[i];
    const std::string place = "held[" + std::to_string(i) + "]";
    const auto found = std::find_if(garments.begin(), garments.end(), [&](const HeldGarment& one) {
      return one.name == ring.garment;
    });
    if (found == garments.end()) {
      std::string names;
      for (const HeldGarment& one : garments) {
        names += (names.empty() ? "" : ", ") + one.name;
      }
      throw DataError(file, place + ".garment", "'" + ring.garment.substr(0, 40) + "'",
                      names.empty() ? "no garment is worn" : "one of what is worn: " + names);
    }
    const int last = *std::max_element(ring.vertices.begin(), ring.vertices.end());
    if (last >= found->vertices) {
      throw DataError(file, place + ".vertices", "vertex " + std::to_string(last),
                      "one of the " + std::to_string(found->vertices) + " of " + ring.garment +
                          ": the file of this garment");
    }
  }
}

std::vector<HeldRing> rings_of(const std::vector<HeldRing>& rings, const std::string& garment) {
  std::vector<HeldRing> own;
  std::copy_if(rings.begin(), rings.end(), std::back_inserter(own),
               [&](const HeldRing& ring) { return ring.garment == garment; });
  return own;
}

}  // namespace atelier
