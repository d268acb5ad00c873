// SPDX-License-Identifier: Apache-2.0
#include "config/detail/syntax_hint.h"

#include <algorithm>
#include <optional>
#include <sstream>
#include <utility>
#include <vector>

namespace tandem::config {
namespace {

std::string lineName(int line) { return "line " + std::to_string(line + 1); }

std::vector<std::string> linesOf(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);)
    lines.push_back(line);
  return lines;
}

/// Reads brackets and quotes of lines, without comments; the first that does not fit is the hint.
class Brackets {
 public:
  std::optional<std::string> read(const std::string& text, int line) {
    for (std::size_t i = 0; i < text.size(); ++i) {
      const char c = text[i];
      if (quote_ != 0) {
        if (c == '\\' && quote_ == '"')
          ++i;
        else if (c == quote_)
          quote_ = 0;
      } else if (c == '#' && (i == 0 || text[i - 1] == ' ')) {
        break;
      } else if ((c == '"' || c == '\'') && (i == 0 || std::string(" [{,").find(text[i - 1]) != std::string::npos)) {
        quote_ = c;
        quoted_ = line;
      } else if (c == '[' || c == '{') {
        open_.emplace_back(c, line);
      } else if ((c == ']' || c == '}') && !closes(c)) {
        return open_.empty() ? std::string("the '") + c + "' of " + lineName(line) + " closes nothing"
                             : "the '" + std::string(1, open_.back().first) + "' of " + lineName(open_.back().second) +
                                   " is closed by '" + c + "' in " + lineName(line);
      }
    }
    return std::nullopt;
  }
  std::string atEnd() const {
    if (quote_ != 0)
      return "the quote " + std::string(1, quote_) + " of " + lineName(quoted_) + " is not closed";
    return open_.empty() ? ""
                         : "the '" + std::string(1, open_.back().first) + "' of " + lineName(open_.back().second) +
                               " is not closed";
  }

 private:
  bool closes(char c) {
    if (open_.empty() || open_.back().first != (c == ']' ? '[' : '{'))
      return false;
    open_.pop_back();
    return true;
  }

  std::vector<std::pair<char, int>> open_;
  char quote_ = 0;
  int quoted_ = 0;
};

std::string bracketHint(const std::vector<std::string>& lines) {
  Brackets brackets;
  for (std::size_t k = 0; k < lines.size(); ++k) {
    if (const auto wrong = brackets.read(lines[k], static_cast<int>(k)))
      return *wrong;
  }
  return brackets.atEnd();
}

/// Whether a line has a text, but is neither a comment, nor an element of a list, nor a key with a value.
bool isWithoutColon(const std::string& line) {
  const std::size_t first = line.find_first_not_of(' ');
  return first != std::string::npos && line[first] != '#' && line[first] != '-' &&
         line.find(": ") == std::string::npos && !line.ends_with(':');
}

}  // namespace

std::string syntaxHint(const std::string& text, int line) {
  const std::vector<std::string> lines = linesOf(text);
  for (std::size_t k = 0; k < lines.size(); ++k) {
    const std::size_t first = lines[k].find_first_not_of(" \t");
    if (first != std::string::npos && lines[k][first] != '#' &&
        lines[k].substr(0, first).find('\t') != std::string::npos)
      return "; a tab indents " + lineName(static_cast<int>(k)) + ", expected spaces";
  }
  if (const std::string hint = bracketHint(lines); !hint.empty())
    return "; " + hint;
  for (int k = std::max(line - 1, 0); k <= line && static_cast<std::size_t>(k) < lines.size(); ++k) {
    if (isWithoutColon(lines[static_cast<std::size_t>(k)]))
      return "; " + lineName(k) + " has no colon with a blank after it, expected `key: value`";
  }
  return "; check the indentation of " + lineName(line) + " and of the line before it";
}

bool isCutOff(const std::string& key) {
  return !key.empty() && std::ranges::all_of(key, [](unsigned char c) { return c >= '0' && c <= '9'; });
}

}  // namespace tandem::config
