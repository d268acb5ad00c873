// SPDX-License-Identifier: Apache-2.0
declare module "@msg/*?raw" {
  const text: string;
  export default text;
}
