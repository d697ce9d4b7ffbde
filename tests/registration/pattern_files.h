#pragma once

#include <cstdlib>
#include <map>
#include <regex>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace atelier::fixtures {

using Loop = std::vector<std::pair<double, double>>;

/// A DXF R12 file as another program would read it, strictly: every line has its place, or
/// std::runtime_error says which has not.
struct ReadDxf {
  std::string version;
  std::map<std::string, std::map<std::string, std::vector<Loop>>> closed;  ///< block, layer
  std::map<std::string, std::map<std::string, int>> lines;                 ///< block, layer
  std::vector<std::string> inserted;
  std::vector<std::string> texts;
};

inline ReadDxf read_dxf(const std::string& text) {
  std::vector<std::pair<int, std::string>> pairs;
  std::size_t at = 0;
  const auto line = [&] {
    const std::size_t end = text.find("\r\n", at);
    if (end == std::string::npos) {
      throw std::runtime_error("no end of line after byte " + std::to_string(at));
    }
    std::string value = text.substr(at, end - at);
    at = end + 2;
    return value;
  };
  while (at < text.size()) {
    const std::string code = line();
    if (code.size() != 3 || code.find_first_not_of(" 0123456789") != std::string::npos) {
      throw std::runtime_error("group code '" + code + "'");
    }
    pairs.emplace_back(std::atoi(code.c_str()), line());
  }
  ReadDxf dxf;
  std::size_t i = 0;
  const auto need = [&](int code, const std::string& value) {
    if (i >= pairs.size() || pairs[i].first != code || pairs[i].second != value) {
      throw std::runtime_error("pair " + std::to_string(i) + " is not " + value);
    }
    ++i;
  };
  // The codes of one entity, up to the next 0.
  const auto codes = [&] {
    std::map<int, std::string> found;
    for (; i < pairs.size() && pairs[i].first != 0; ++i) {
      if (!found.emplace(pairs[i].first, pairs[i].second).second) {
        throw std::runtime_error("group code twice: " + std::to_string(pairs[i].first));
      }
    }
    return found;
  };
  const auto entity = [&](const std::string& block) {
    const std::string type = pairs[i++].second;
    const std::map<int, std::string> own = codes();
    const std::string layer = own.at(8);
    if (type == "POLYLINE") {
      if (own.at(66).find('1') == std::string::npos) {
        throw std::runtime_error("a polyline without vertices");
      }
      const bool closed = std::atoi(own.at(70).c_str()) == 1;
      Loop loop;
      while (pairs.at(i).second == "VERTEX") {
        ++i;
        const auto vertex = codes();
        loop.emplace_back(std::stod(vertex.at(10)), std::stod(vertex.at(20)));
      }
      need(0, "SEQEND");
      codes();
      if (closed) {
        dxf.closed[block][layer].push_back(loop);
      }
    } else if (type == "LINE") {
      std::stod(own.at(11));
      ++dxf.lines[block][layer];
    } else if (type == "TEXT") {
      dxf.texts.push_back(own.at(1));
    } else if (type == "INSERT") {
      if (dxf.closed.count(own.at(2)) == 0) {
        throw std::runtime_error("insert of no block: " + own.at(2));
      }
      dxf.inserted.push_back(own.at(2));
    } else {
      throw std::runtime_error("entity " + type);
    }
  };
  need(0, "SECTION");
  need(2, "HEADER");
  for (; pairs.at(i) != std::pair<int, std::string>(0, "ENDSEC"); ++i) {
    if (pairs[i].second == "$ACADVER") {
      dxf.version = pairs.at(i + 1).second;
    }
  }
  need(0, "ENDSEC");
  need(0, "SECTION");
  need(2, "TABLES");
  while (pairs.at(i) != std::pair<int, std::string>(0, "ENDSEC")) {
    ++i;
  }
  need(0, "ENDSEC");
  need(0, "SECTION");
  need(2, "BLOCKS");
  while (pairs.at(i).second == "BLOCK") {
    ++i;
    const std::string name = codes().at(2);
    while (pairs.at(i).second != "ENDBLK") {
      entity(name);
    }
    ++i;
    codes();
  }
  need(0, "ENDSEC");
  need(0, "SECTION");
  need(2, "ENTITIES");
  while (pairs.at(i).second != "ENDSEC") {
    entity("");
  }
  need(0, "ENDSEC");
  need(0, "EOF");
  if (i != pairs.size()) {
    throw std::runtime_error("something after EOF");
  }
  return dxf;
}

/// An SVG of ours: size in mm, viewBox, and the paths by id, in millimetres.
struct ReadSvg {
  double width = 0, height = 0;
  std::map<std::string, Loop> paths;
  std::vector<std::string> layers;
};

inline ReadSvg read_svg(const std::string& text) {
  ReadSvg svg;
  // Tags are balanced.
  std::vector<std::string> open;
  for (std::size_t at = text.find('<'); at != std::string::npos; at = text.find('<', at + 1)) {
    const std::size_t end = text.find('>', at);
    if (end == std::string::npos) {
      throw std::runtime_error("a tag without an end");
    }
    const std::string tag = text.substr(at + 1, end - at - 1);
    const std::string name = tag.substr(0, tag.find_first_of(" \n/", 1));
    if (tag[0] == '?') {
      continue;
    }
    if (tag[0] == '/') {
      if (open.empty() || "/" + open.back() != tag) {
        throw std::runtime_error("tag " + tag + " closes nothing");
      }
      open.pop_back();
    } else if (tag.back() != '/') {
      open.push_back(name);
    }
    std::smatch found;
    if (name == "svg") {
      const std::regex size(
          "width=\"([0-9.]+)mm\" height=\"([0-9.]+)mm\" "
          "viewBox=\"0 0 ([0-9.]+) ([0-9.]+)\"");
      if (!std::regex_search(tag, found, size) || found[1] != found[3] || found[2] != found[4]) {
        throw std::runtime_error("no true scale");
      }
      svg.width = std::stod(found[1]);
      svg.height = std::stod(found[2]);
    }
    if (std::regex_search(tag, found, std::regex("inkscape:label=\"([a-z]+)\""))) {
      svg.layers.push_back(found[1]);
    }
    if (std::regex_search(tag, found, std::regex("id=\"([^\"]*)\" d=\"M([^\"]*)\""))) {
      Loop loop;
      const std::string d = found[2];
      const std::regex point("(-?[0-9.]+),(-?[0-9.]+)");
      for (auto it = std::sregex_iterator(d.begin(), d.end(), point); it != std::sregex_iterator();
           ++it) {
        loop.emplace_back(std::stod((*it)[1]), std::stod((*it)[2]));
      }
      svg.paths[found[1]] = loop;
    }
  }
  if (!open.empty()) {
    throw std::runtime_error("<" + open.back() + "> is not closed");
  }
  return svg;
}

inline double area_of(const Loop& loop) {
  double twice = 0;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const auto& [x, y] = loop[i];
    const auto& [next_x, next_y] = loop[(i + 1) % loop.size()];
    twice += x * next_y - y * next_x;
  }
  return twice / 2;
}

}  // namespace atelier::fixtures
