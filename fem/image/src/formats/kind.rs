//! Detection of a file's format from its first bytes.

use std::io::Read;
use std::path::Path;

use flate2::read::MultiGzDecoder;

use crate::ImageError;
use fem_file::open_regular;

/// Number of bytes read from a file; sufficient to recognise all formats.
const HEAD: usize = 4096;
/// Beginning of the advice on how to convert an array to a TIFF stack; each format adds the Python code that reads the
/// array.
const ARRAY: &str = "write the array as a TIFF stack in Python: import tifffile;";
const IMAGEJ: &str = "open it in Fiji/ImageJ and save it by File > Save As > Tiff";

/// The format of a file.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Kind {
    Tiff,
    Png,
    Bmp,
    MetaImage,
    Nrrd,
    Hdf5,
    /// A format that is not supported: its name, and advice on how to convert it.
    Foreign(&'static str, String),
    /// An unknown format.
    Unknown,
}

/// Returns the format of a file, which is recognised by the content of the file.
///
/// # Errors
/// [`ImageError::Io`] if the file cannot be read.
pub(super) fn kind_of(path: &Path) -> Result<Kind, ImageError> {
    let failed = |source| ImageError::io("read", path, source);
    let mut head = Vec::with_capacity(HEAD);
    let file = open_regular(path).map_err(failed)?;
    file.take(HEAD as u64).read_to_end(&mut head).map_err(failed)?;
    let file = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    Ok(of_bytes(&head, &file))
}

/// Returns the format of a file, which is recognised by its first bytes. `file` is the name of the file for the advice.
fn of_bytes(head: &[u8], file: &str) -> Kind {
    let starts = |magic: &[u8]| head.starts_with(magic);
    let at = |offset: usize, magic: &[u8]| {
        head.get(offset..).is_some_and(|rest| rest.starts_with(magic))
    };
    let foreign = |name: &'static str, help: String| Kind::Foreign(name, help);
    if [&b"II\x2a\0"[..], b"MM\0\x2a", b"II\x2b\0", b"MM\0\x2b"].into_iter().any(starts) {
        return Kind::Tiff;
    }
    if starts(b"\x89PNG\r\n\x1a\n") {
        return Kind::Png;
    }
    if starts(b"NRRD000") {
        return Kind::Nrrd;
    }
    // a text file may also begin with the letters BM, so check the header length of a bitmap, too
    if starts(b"BM")
        && (at(14, &[40, 0, 0, 0]) || at(14, &[108, 0, 0, 0]) || at(14, &[124, 0, 0, 0]))
    {
        return Kind::Bmp;
    }
    let text = String::from_utf8_lossy(head);
    if is_metaimage(&text) {
        return Kind::MetaImage;
    }
    if [0, 512, 1024, 2048].into_iter().any(|offset| at(offset, b"\x89HDF\r\n\x1a\n")) {
        return Kind::Hdf5;
    }
    if at(128, b"DICM") {
        let help = "import the folder in Fiji/ImageJ by File > Import > Image Sequence and save it by File > Save As > Tiff";
        return foreign("a DICOM file", help.into());
    }
    if is_nifti(head) {
        let help = format!(
            "{ARRAY} import nibabel; tifffile.imwrite(\"scan.tif\", nibabel.load(\"{file}\").get_fdata().T.astype(\"float32\")), and give voxel_mm"
        );
        return foreign("a NIfTI file", help);
    }
    if starts(b"\xff\xd8\xff") || starts(b"\0\0\0\x0cjP  \r\n\x87\n") || starts(b"\xff\x4f\xff\x51")
    {
        let help = "JPEG changes grey values near edges and the noise, on which thresholds depend: export the scan again as TIFF or PNG";
        return foreign("a JPEG image", help.into());
    }
    if starts(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1") {
        let help = "export a Zeiss TXM as a TIFF stack in Scout-and-Scan or XMController, or in Python by dxchange.read_txrm; a TXRM contains projections and must be reconstructed first";
        return foreign("an OLE file (Zeiss TXM or TXRM)", help.into());
    }
    if starts(b"# AmiraMesh") || starts(b"# Avizo") || starts(b"# HyperSurface") {
        let help = "save it in Amira or Avizo by Export Data As > 3D TIFF or NRRD";
        return foreign("an Amira or Avizo file", help.into());
    }
    if is_vgi(&text) {
        let help = format!(
            "write a header for its raw file (.vol), with the size, type and voxel size of the VGI header: {}",
            header_lines("scan.vol")
        );
        return foreign("a VGI header (VGStudio)", help);
    }
    let others: [(&[u8], usize, &'static str, String); 22] = [
        (b"\x93NUMPY", 0, "a NumPy array", format!("{ARRAY} import numpy; tifffile.imwrite(\"scan.tif\", numpy.load(\"{file}\")), and give voxel_mm")),
        (b"MATLAB 5.0 MAT-file", 0, "a MATLAB file", format!("{ARRAY} import scipy.io; tifffile.imwrite(\"scan.tif\", scipy.io.loadmat(\"{file}\")[\"NAME\"].T), and give voxel_mm")),
        (b"CDF\x01", 0, "a netCDF file", format!("{ARRAY} import scipy.io; tifffile.imwrite(\"scan.tif\", scipy.io.netcdf_file(\"{file}\").variables[\"tomo\"][:]), and give voxel_mm")),
        (b"CDF\x02", 0, "a netCDF file", format!("{ARRAY} import scipy.io; tifffile.imwrite(\"scan.tif\", scipy.io.netcdf_file(\"{file}\").variables[\"tomo\"][:]), and give voxel_mm")),
        (b"CTDATA-HEADER_V1", 0, "a Scanco ISQ file", "import it in Fiji/ImageJ by the plugin KHKs_Scanco_ISQ_FileReader and save it by File > Save As > Tiff".into()),
        (b"MAP ", 208, "an MRC file", format!("{ARRAY} import mrcfile; tifffile.imwrite(\"scan.tif\", mrcfile.read(\"{file}\")), and give voxel_mm")),
        (b"SIMPLE  =", 0, "a FITS file", format!("{ARRAY} import astropy.io.fits as fits; tifffile.imwrite(\"scan.tif\", fits.getdata(\"{file}\")), and give voxel_mm")),
        (b"ZISRAWFILE", 0, "a Zeiss CZI file", IMAGEJ.into()),
        (b"# vtk DataFile", 0, "a VTK file", "save it in ParaView by File > Save Data as MetaImage (.mhd)".into()),
        (b"<VTKFile", 0, "a VTK file", "save it in ParaView by File > Save Data as MetaImage (.mhd)".into()),
        (b"<?xml version=\"1.0\"?>\n<VTKFile", 0, "a VTK file", "save it in ParaView by File > Save Data as MetaImage (.mhd)".into()),
        (b"GIF8", 0, "a GIF image", "it has 256 colours at most: export the scan again as TIFF or PNG".into()),
        (b"WEBP", 8, "a WebP image", "it may have lost grey values: export the scan again as TIFF or PNG".into()),
        (b"%PDF", 0, "a PDF document", "name the file or folder of the scan".into()),
        (b"PK\x03\x04", 0, "a ZIP archive", "unpack it, and name the file or folder inside".into()),
        (b"Rar!\x1a\x07", 0, "a RAR archive", "unpack it, and name the file or folder inside".into()),
        (b"7z\xbc\xaf\x27\x1c", 0, "a 7z archive", "unpack it, and name the file or folder inside".into()),
        (b"\x1f\x8b", 0, "a file packed by gzip", "unpack it by gunzip, and name the file inside".into()),
        (b"\xfd7zXZ\0", 0, "a file packed by xz", "unpack it by unxz, and name the file inside".into()),
        (b"BZh", 0, "a file packed by bzip2", "unpack it by bunzip2, and name the file inside".into()),
        (b"\x28\xb5\x2f\xfd", 0, "a file packed by zstd", "unpack it by unzstd, and name the file inside".into()),
        (b"ustar", 257, "a TAR archive", "unpack it, and name the file or folder inside".into()),
    ];
    for (magic, offset, name, help) in others {
        if at(offset, magic) {
            return foreign(name, help);
        }
    }
    if text.trim_start().starts_with('{') && text.contains("Dim_1") {
        let help = format!(
            "{ARRAY} import fabio; one slice per file: tifffile.imwrite(\"slice.tif\", fabio.open(\"{file}\").data)"
        );
        return foreign("an EDF file (ESRF)", help);
    }
    Kind::Unknown
}

/// Returns advice on the header that a file of raw values needs, in one line.
pub(super) fn header_lines(data: &str) -> String {
    format!(
        "write a text file scan.mhd into the same folder, with the lines `NDims = 3`, `DimSize = 1000 1000 800`, `ElementType = MET_USHORT`, \
         `ElementByteOrderMSB = False`, `ElementSpacing = 0.01 0.01 0.01` (mm), `ElementDataFile = {data}`, and name scan.mhd as the stack"
    )
}

/// Returns whether a text is a MetaImage header: its first key is a MetaImage key, and it contains `DimSize`.
fn is_metaimage(text: &str) -> bool {
    let keys = ["ObjectType", "NDims", "DimSize", "Comment", "ElementType"];
    let first = text.trim_start().lines().next().and_then(|line| line.split_once('='));
    first.is_some_and(|(key, _)| keys.contains(&key.trim())) && text.contains("DimSize")
}

fn is_vgi(text: &str) -> bool {
    let text = text.trim_start();
    text.starts_with("{volume") || text.starts_with("[volume") || text.contains("[file1]")
}

fn is_nifti(head: &[u8]) -> bool {
    let mut unpacked = Vec::new();
    let bytes = match head.starts_with(b"\x1f\x8b") {
        true => {
            // ignore the error: only the first bytes of the compressed file are unpacked, so that the data end too
            // early
            let _ = MultiGzDecoder::new(head).take(352).read_to_end(&mut unpacked);
            &unpacked
        }
        false => head,
    };
    let magic =
        |at: usize, magic: &[u8]| bytes.get(at..).is_some_and(|rest| rest.starts_with(magic));
    let size = bytes.first_chunk::<4>();
    let is_first = size
        .is_some_and(|&size| i32::from_le_bytes(size) == 348 || i32::from_be_bytes(size) == 348);
    (is_first && (magic(344, b"n+1\0") || magic(344, b"ni1\0"))) || magic(4, b"n+2\0\r\n\x1a\n")
}
