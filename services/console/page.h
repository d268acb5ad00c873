// SPDX-License-Identifier: Apache-2.0
/** @file Files of the page: path lookup and HTTP headers. */
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace tandem::console {

/** A file to be sent. */
struct PageFile {
  std::filesystem::path path;
  std::string type;      ///< Content-Type
  std::string etag;      ///< changes with the file
  bool lasting = false;  ///< its name changes with its contents: browsers may keep it
};

/** A folder with index.html. Every request looks at the disk: files are few, and a page that is built anew shows. */
class Page {
 public:
  /// @param folder  empty: there is no page
  explicit Page(const std::filesystem::path& folder);

  bool present() const { return !folder_.empty(); }
  const std::filesystem::path& folder() const { return folder_; }
  /// The file that a path stands for ("/" is index.html); nothing for one that is not there, or lies outside the
  /// folder, however it is written.
  std::optional<PageFile> find(std::string_view path) const;

 private:
  std::filesystem::path folder_;
};

/// A page in place of one that is not installed: what else is served here.
extern const std::string_view kNoPage;

/// What browsers may do with our pages: nothing from elsewhere, no framing.
extern const std::string_view kContentSecurityPolicy;

}  // namespace tandem::console
