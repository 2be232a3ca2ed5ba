//! What the connections of a page share.

use std::sync::Arc;

use crate::access::Access;
use crate::limits::Limits;
use crate::subject::Subject;

/// What all connections share.
pub(crate) struct Site {
    pub(crate) access: Access,
    pub(crate) limits: Limits,
    pub(crate) subject: Arc<dyn Subject>,
}
