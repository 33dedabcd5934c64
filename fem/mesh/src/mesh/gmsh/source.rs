//! A cursor over the bytes of a MSH file that reads both ASCII and binary numbers.

/// An error at a position in the file.
pub(super) struct Fault {
    /// Position in the file: line (ASCII), or section and byte (binary).
    pub(super) location: String,
    pub(super) message: String,
}

/// The supported major versions of the MSH format.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Version {
    V2,
    V4,
}

/// A cursor over the bytes of a MSH file.
pub(super) struct Source<'a> {
    bytes: &'a [u8],
    /// Index of the next byte.
    at: usize,
    /// Name of the current section, without `$`; empty outside of sections.
    section: String,
    pub(super) binary: bool,
    big_endian: bool,
}

impl<'a> Source<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Source<'a> {
        // some editors write a byte-order mark at the start of a text file
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        Source { bytes, at: 0, section: String::new(), binary: false, big_endian: false }
    }

    /// Creates an error at the current position: a line in ASCII files, section and byte in binary files.
    pub(super) fn fault(&self, message: String) -> Fault {
        let location = if self.binary {
            format!("section ${}, byte {}", self.section, self.at)
        } else {
            let line = 1 + self.bytes[..self.at].iter().filter(|&&b| b == b'\n').count();
            match self.section.as_str() {
                "" => format!("line {line}"),
                section => format!("line {line} (section ${section})"),
            }
        };
        Fault { location, message }
    }

    /// Reads the `$MeshFormat` section, which must come first.
    pub(super) fn format(&mut self) -> Result<Version, Fault> {
        if self.section()?.as_deref() != Some("MeshFormat") {
            return Err(
                self.fault("this is not a MSH file: the first line must be $MeshFormat".into())
            );
        }
        let version_text = self.word()?.to_string();
        let version = match version_text.as_str() {
            "2" | "2.1" | "2.2" => Version::V2,
            "4.1" => Version::V4,
            other => {
                return Err(self.fault(format!(
                    "MSH version {other} is not supported; save as version 2.2 or 4.1 (gmsh -format msh41)"
                )));
            }
        };
        let binary = match self.word()? {
            "0" => false,
            "1" => true,
            other => {
                let other = other.to_string();
                return Err(self.fault(format!(
                    "file type {other} is neither 0 (ASCII) nor 1 (binary); save the mesh again"
                )));
            }
        };
        let size = self.word()?.to_string();
        if size != "8" {
            return Err(self.fault(format!(
                "data size {size} is not supported; save floating-point numbers with 8 bytes"
            )));
        }
        if binary {
            self.line_end()?;
            self.binary = true;
            let one: [u8; 4] = self.take()?;
            self.big_endian = match (i32::from_le_bytes(one), i32::from_be_bytes(one)) {
                (1, _) => false,
                (_, 1) => true,
                (other, _) => {
                    return Err(self.fault(format!("the integer that marks the byte order is {other} instead of 1; save the mesh again")));
                }
            };
        }
        self.end_section()?;
        Ok(version)
    }

    /// Reads the header of the next section and returns its name, or `None` at the end of the file.
    pub(super) fn section(&mut self) -> Result<Option<String>, Fault> {
        self.section.clear();
        loop {
            let start = self.at;
            let Some(line) = self.line() else { return Ok(None) };
            match line.trim_ascii() {
                [] => {}
                [b'$', name @ ..] => {
                    self.section = String::from_utf8_lossy(name).into_owned();
                    return Ok(Some(self.section.clone()));
                }
                other => {
                    self.at = start;
                    let text = String::from_utf8_lossy(&other[..other.len().min(40)]).into_owned();
                    return Err(self.fault(format!(
                        "expected the first line of a $Section, but the line is `{text}`; save the mesh again as MSH \
                             2.2 or 4.1"
                    )));
                }
            }
        }
    }

    /// Reads the `$End…` line of the current section.
    pub(super) fn end_section(&mut self) -> Result<(), Fault> {
        self.skip_blanks();
        let expected = format!("$End{}", self.section);
        if !self.bytes[self.at..].starts_with(expected.as_bytes()) {
            return Err(self.fault(format!(
                "expected {expected}, but the section has more data than it announces; save the mesh again"
            )));
        }
        self.at += expected.len();
        self.line();
        Ok(())
    }

    /// Skips the rest of the current section.
    pub(super) fn skip_section(&mut self) -> Result<(), Fault> {
        let end = format!("$End{}", self.section);
        let rest = &self.bytes[self.at..];
        match rest.windows(end.len()).position(|window| window == end.as_bytes()) {
            Some(offset) => {
                self.at += offset + end.len();
                self.line();
                Ok(())
            }
            None => {
                Err(self
                    .fault(format!("{end} is missing: the file is truncated; save the mesh again")))
            }
        }
    }

    /// Reads the rest of the line and returns its bytes without the line break.
    fn line(&mut self) -> Option<&'a [u8]> {
        let rest = &self.bytes[self.at..];
        if rest.is_empty() {
            return None;
        }
        let length = rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
        self.at += (length + 1).min(rest.len());
        Some(&rest[..length])
    }

    /// Reads the rest of the current line as text.
    pub(super) fn text_line(&mut self) -> Result<String, Fault> {
        match self.line() {
            Some(line) => Ok(String::from_utf8_lossy(line).trim().to_string()),
            None => Err(self.cut_short()),
        }
    }

    /// Skips the line break before binary data.
    pub(super) fn line_end(&mut self) -> Result<(), Fault> {
        match self.line() {
            Some(rest) if rest.trim_ascii().is_empty() => Ok(()),
            _ => Err(self.fault("expected the end of the line; save the mesh again".into())),
        }
    }

    fn skip_blanks(&mut self) {
        while self.bytes.get(self.at).is_some_and(u8::is_ascii_whitespace) {
            self.at += 1;
        }
    }

    fn cut_short(&self) -> Fault {
        self.fault("the file ends too early; save it again".into())
    }

    /// Reads the next word of text.
    pub(super) fn word(&mut self) -> Result<&'a str, Fault> {
        self.skip_blanks();
        let rest = &self.bytes[self.at..];
        let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        if length == 0 {
            return Err(self.cut_short());
        }
        let word = std::str::from_utf8(&rest[..length]).map_err(|_| {
            self.fault(
                "expected ASCII text, but the bytes are not text; save the mesh again".into(),
            )
        })?;
        self.at += length;
        Ok(word)
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], Fault> {
        let bytes = self.bytes.get(self.at..self.at + N).and_then(|b| b.try_into().ok());
        let bytes = bytes.ok_or_else(|| self.cut_short())?;
        self.at += N;
        Ok(bytes)
    }

    /// Reads a number that is written as text in both ASCII and binary files.
    pub(super) fn text<T: std::str::FromStr>(&mut self, what: &str) -> Result<T, Fault> {
        let word = self.word()?;
        word.parse().map_err(|_| {
            // create the error while the cursor is directly after the word, so that the error reports the correct line
            self.fault(format!("`{word}` is not a valid value for {what}"))
        })
    }

    /// Reads a signed 32-bit integer.
    pub(super) fn int(&mut self, what: &str) -> Result<i32, Fault> {
        if !self.binary {
            return self.text(what);
        }
        let bytes = self.take()?;
        Ok(if self.big_endian { i32::from_be_bytes(bytes) } else { i32::from_le_bytes(bytes) })
    }

    /// Reads an unsigned 64-bit integer (`size_t` in the format).
    pub(super) fn size(&mut self, what: &str) -> Result<u64, Fault> {
        if !self.binary {
            return self.text(what);
        }
        let bytes = self.take()?;
        Ok(if self.big_endian { u64::from_be_bytes(bytes) } else { u64::from_le_bytes(bytes) })
    }

    /// Reads a floating-point number.
    pub(super) fn real(&mut self, what: &str) -> Result<f64, Fault> {
        if !self.binary {
            return self.text(what);
        }
        let bytes = self.take()?;
        Ok(if self.big_endian { f64::from_be_bytes(bytes) } else { f64::from_le_bytes(bytes) })
    }

    /// Reads three coordinates.
    pub(super) fn point(&mut self) -> Result<[f64; 3], Fault> {
        let what = "a coordinate";
        Ok([self.real(what)?, self.real(what)?, self.real(what)?])
    }
}
