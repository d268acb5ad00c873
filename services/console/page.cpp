// SPDX-License-Identifier: Apache-2.0
#include "services/console/page.h"

#include <sys/stat.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <vector>

namespace tandem::console {
namespace {

namespace fs = std::filesystem;

std::string typeOf(const fs::path& file) {
  static const std::map<std::string, std::string> types{{".html", "text/html; charset=utf-8"},
                                                        {".js", "text/javascript; charset=utf-8"},
                                                        {".css", "text/css; charset=utf-8"},
                                                        {".json", "application/json"},
                                                        {".map", "application/json"},
                                                        {".svg", "image/svg+xml"},
                                                        {".png", "image/png"},
                                                        {".ico", "image/x-icon"},
                                                        {".woff2", "font/woff2"},
                                                        {".wasm", "application/wasm"},
                                                        {".txt", "text/plain; charset=utf-8"},
                                                        {".stl", "model/stl"}};
  const auto found = types.find(file.extension().string());
  return found == types.end() ? "application/octet-stream" : found->second;
}

/// Characters of the page's file names; no others are accepted, so that no path leaves the folder.
bool isPlain(std::string_view path) {
  const bool letters = std::all_of(path.begin(), path.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           std::string_view("/-_.").find(c) != std::string_view::npos;
  });
  return letters && path.starts_with('/') && path.size() < 500 && path.find("/.") == std::string_view::npos &&
         path.find("//") == std::string_view::npos;
}

/// "a, b;q=0.5" -> each part without spaces.
std::vector<std::string> partsOf(std::string_view list, char separator) {
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin <= list.size();) {
    const std::size_t end = std::min(list.find(separator, begin), list.size());
    std::string& part = parts.emplace_back(list.substr(begin, end - begin));
    std::erase_if(part, [](char c) { return c == ' ' || c == '\t'; });
    begin = end + 1;
  }
  return parts;
}

std::optional<struct stat> statusOf(const fs::path& file) {
  struct stat about {};
  return stat(file.c_str(), &about) == 0 && S_ISREG(about.st_mode) ? std::optional(about) : std::nullopt;
}

bool isOlder(const timespec& one, const timespec& other) {
  return one.tv_sec != other.tv_sec ? one.tv_sec < other.tv_sec : one.tv_nsec < other.tv_nsec;
}

}  // namespace

bool acceptsGzip(std::string_view accept_encoding) {
  for (const std::string& entry : partsOf(accept_encoding, ',')) {
    const std::vector<std::string> words = partsOf(entry, ';');
    if (words[0] == "gzip" || words[0] == "*")
      return words.size() < 2 || !words[1].starts_with("q=") || std::strtod(words[1].c_str() + 2, nullptr) > 0.0;
  }
  return false;
}

Page::Page(const fs::path& folder) {
  std::error_code ignored;
  if (!folder.empty() && fs::is_regular_file(folder / "index.html", ignored))
    folder_ = fs::canonical(folder, ignored);
}

std::optional<PageFile> Page::find(std::string_view path, bool gzip) const {
  if (!present() || !isPlain(path))
    return std::nullopt;
  const std::string name = path == "/" ? "/index.html" : std::string(path);
  std::error_code error;
  // Symbolic links may point outside the folder.
  const fs::path file = fs::canonical(folder_ / name.substr(1), error);
  auto about = error ? std::nullopt : statusOf(file);
  if (!about || !file.string().starts_with(folder_.string() + "/"))
    return std::nullopt;
  PageFile found{file, typeOf(file), "", name.starts_with("/assets/")};
  const auto copy = gzip ? statusOf(file.string() + ".gz") : std::nullopt;
  if (copy && !isOlder(copy->st_mtim, about->st_mtim)) {
    found.path += ".gz";
    found.compressed = true;
    about = copy;
  }
  found.etag = "\"" + std::to_string(about->st_mtim.tv_sec) + "." + std::to_string(about->st_mtim.tv_nsec) + "-" +
               std::to_string(about->st_size) + (found.compressed ? "-gzip" : "") + "\"";
  return found;
}

const std::string_view kNoPage = R"(<!doctype html>
<html lang="en"><meta charset="utf-8"><title>tandem-console</title>
<h1>tandem-console</h1>
<p>The operator's page is not built here: <code>deploy/run.sh --with page</code> builds it (or option <code>--page FOLDER</code>). The robot's data is available nevertheless:</p>
<ul>
<li>Foxglove, Lichtblick, PlotJuggler: open a Foxglove WebSocket connection to this host and port.</li>
<li><a href="/api/robot">/api/robot</a>, <a href="/api/trajectories">/api/trajectories</a>,
<a href="/api/stats">/api/stats</a>, <a href="/healthz">/healthz</a></li>
</ul></html>
)";

// Styles: the page's libraries set them on elements. connect-src 'self' includes WebSockets of the same origin.
const std::string_view kContentSecurityPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; font-src "
    "'self'; connect-src 'self'; worker-src 'self' blob:; manifest-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'";

}  // namespace tandem::console
