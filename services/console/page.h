// SPDX-License-Identifier: Apache-2.0
/** @file Files of the page: path lookup and HTTP headers. */
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace tandem::console {

/** File of the page. */
struct PageFile {
  std::filesystem::path path;
  std::string type;         ///< Content-Type
  std::string etag;         ///< changes with the file
  bool lasting = false;     ///< its name changes with its contents: browsers may cache it
  bool compressed = false;  ///< Content-Encoding gzip
};

/** A folder with index.html, and beside large files copies NAME.gz, which console/vite.config.ts writes. Every request
 * reads the disk: files are few, and a rebuilt page takes effect at once. */
class Page {
 public:
  /// @param folder  empty: there is no page
  explicit Page(const std::filesystem::path& folder);

  bool present() const { return !folder_.empty(); }
  const std::filesystem::path& folder() const { return folder_; }
  /// The file of a path ("/" is index.html); empty if it does not exist or is outside the folder in any notation.
  /// @param gzip  whether the client takes the compressed copy, which is sent if it is not older than the file
  std::optional<PageFile> find(std::string_view path, bool gzip) const;

 private:
  std::filesystem::path folder_;
};

/// Whether a header Accept-Encoding permits gzip.
bool acceptsGzip(std::string_view accept_encoding);

/// Page in place of one that is not installed: lists the other resources of this server.
extern const std::string_view kNoPage;

/// Content-Security-Policy of the page: nothing from other servers, no framing.
extern const std::string_view kContentSecurityPolicy;

}  // namespace tandem::console
