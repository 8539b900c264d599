use embedded_storage_async::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};

/// Flash that is only looked at: to repair is for whoever is about to write.
pub(crate) struct ReadOnly<'a, F>(pub(crate) &'a mut F);

/// Why an access failed.
#[derive(Debug)]
pub(crate) enum ReadOnlyError<E> {
    /// The flash did.
    Flash(E),
    /// It was not a read.
    Refused,
}

impl<E: NorFlashError> NorFlashError for ReadOnlyError<E> {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Flash(error) => error.kind(),
            Self::Refused => NorFlashErrorKind::Other,
        }
    }
}

impl<F: ErrorType> ErrorType for ReadOnly<'_, F> {
    type Error = ReadOnlyError<F::Error>;
}

impl<F: ReadNorFlash> ReadNorFlash for ReadOnly<'_, F> {
    const READ_SIZE: usize = F::READ_SIZE;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
        self.0
            .read(offset, bytes)
            .await
            .map_err(ReadOnlyError::Flash)
    }

    fn capacity(&self) -> usize {
        self.0.capacity()
    }
}

impl<F: NorFlash> NorFlash for ReadOnly<'_, F> {
    const WRITE_SIZE: usize = F::WRITE_SIZE;
    const ERASE_SIZE: usize = F::ERASE_SIZE;

    async fn erase(&mut self, _from: u32, _to: u32) -> Result<(), Self::Error> {
        Err(ReadOnlyError::Refused)
    }

    async fn write(&mut self, _offset: u32, _bytes: &[u8]) -> Result<(), Self::Error> {
        Err(ReadOnlyError::Refused)
    }
}
