"""A diagnosis as one HTML page, or as Markdown."""
from ssi_ros.gap.settings import DiagnosisSettings
from ssi_ros.report.diagnosis_sections import diagnosis_sections, summary
from ssi_ros.report.gap_view import gap_view
from ssi_ros.report.markdown import markdown
from ssi_ros.report.page import page


def diagnosis_page(diagnosis, view=None, *, bag='BAG', nominal='--model MODEL.yaml', more=()):
    """
    Return a diagnosis as an HTML page that needs no network.

    Parameters
    ----------
    diagnosis : Diagnosis
        From a model or from a reference record.
    view : GapView, optional
        Curves, of `view_of`, or of `gap_view.reference_view`.
    bag, nominal : str
        For the title and the commands; `nominal` is '--model FILE' or '--reference BAG'.
    more : tuple of Section
        Behind the others, as `input_section` of recorded inputs.

    Returns
    -------
    str

    """
    found = diagnosis.to_json()
    return page(f'Diagnosis of {bag}', summary(found), diagnosis_sections(
        found, view, bag=bag, nominal=nominal) + tuple(more))


def diagnosis_markdown(diagnosis, view=None, *, bag='BAG', nominal='--model MODEL.yaml', more=()):
    """Return the same as Markdown, without the pictures."""
    found = diagnosis.to_json()
    return markdown(f'Diagnosis of {bag}', summary(found), diagnosis_sections(
        found, view, bag=bag, nominal=nominal) + tuple(more))


def view_of(diagnosis, spacecraft, samples, settings=DiagnosisSettings(), present=()):
    """Return the curves of a diagnosis; None where the record is too short for them."""
    built = getattr(diagnosis.candidates[0], 'built', ()) if diagnosis.candidates else ()
    if diagnosis.outcome == 'TOO_LITTLE_DATA':
        return None
    return gap_view(spacecraft, samples, built, settings=settings, present=tuple(present))
