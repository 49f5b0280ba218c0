//! Whether a file is packed.

/// What a file is packed with, if something has.
pub(crate) fn packed(bytes: &[u8]) -> Option<&'static str> {
    let packers: [(&[u8], _); 3] =
        [(b"\x1F\x8B", "gzip"), (b"\x28\xB5\x2F\xFD", "zstd"), (b"PK\x03\x04", "zip")];
    packers.iter().find(|(mark, _)| bytes.starts_with(mark)).map(|(_, packer)| *packer)
}
